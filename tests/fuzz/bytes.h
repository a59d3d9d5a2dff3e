// SPDX-License-Identifier: LGPL-2.1-or-later
// Turns the bytes of an input into choices. After the last byte every choice is the first one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace qdmd::fuzz {

class Bytes {
 public:
  Bytes(const uint8_t* data, size_t size) : data_(data), size_(size) {}

  bool empty() const { return size_ == 0; }
  uint8_t byte() {
    if (size_ == 0) return 0;
    --size_;
    return *data_++;
  }
  uint32_t word() {
    uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8 | byte();
    return value;
  }
  // 0 .. count - 1; count is at most 256.
  int below(int count) { return byte() % count; }
  int from(int least, int most) { return least + below(most - least + 1); }
  // One in so many.
  bool once_in(int count) { return byte() % count == count - 1; }
  // Mostly small; now and then negative, huge, or one beside a limit.
  int any_int() {
    switch (below(8)) {
      case 0:
        return -from(1, 3);
      case 1:
        return std::numeric_limits<int>::max() - below(3);
      case 2:
        return std::numeric_limits<int>::min() + below(3);
      case 3:
        return static_cast<int>(word());
      default:
        return below(32);
    }
  }
  double any_double() {
    switch (below(8)) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return std::numeric_limits<double>::infinity();
      case 2:
        return -std::numeric_limits<double>::infinity();
      case 3:
        return -byte() / 16.0;
      case 4:
        return std::numeric_limits<double>::denorm_min();
      case 5:
        return std::numeric_limits<double>::max();
      default:
        return byte() / 8.0;
    }
  }
  std::string rest() {
    std::string text(reinterpret_cast<const char*>(data_), size_);
    data_ += size_;
    size_ = 0;
    return text;
  }
  std::string text(size_t most) {
    std::string text;
    while (!empty() && text.size() < most) text.push_back(static_cast<char>(byte()));
    return text;
  }

 private:
  const uint8_t* data_;
  size_t size_;
};

}  // namespace qdmd::fuzz

// Each target defines it; libFuzzer calls it, and so does replay.cpp.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
// Targets that need it define it; it is called once, before the first input.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv);
