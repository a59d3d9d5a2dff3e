// SPDX-License-Identifier: LGPL-2.1-or-later
// Fuzz target: a saved background's bytes are read whole, or refused with a sentence.
#include <algorithm>
#include <vector>

#include "core/engine/engine.h"
#include "core/model/learnt_file.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace qdmd;
using Bytes = std::vector<uint8_t>;

void put(Bytes* file, size_t at, uint64_t value, size_t bytes) {
  for (size_t i = 0; i < bytes && at + i < file->size(); ++i)
    (*file)[at + i] = static_cast<uint8_t>(value >> (8 * i));
}

// As the file's last eight bytes have it: what a fuzzer would never guess.
void put_checksum(Bytes* file) {
  if (file->size() < 8) return;
  uint64_t hash = 0xcbf29ce484222325;
  for (size_t i = 0; i + 8 < file->size(); ++i) hash = (hash ^ (*file)[i]) * 0x100000001b3;
  put(file, file->size() - 8, hash, 8);
}

LearntPlace any_place(fuzz::Bytes* bytes) {
  LearntPlace place;
  for (float* levels : {place.look, place.before})
    for (int c = 0; c < 3; ++c) levels[c] = bytes->byte();
  for (uint32_t* time : {&place.since, &place.before_since, &place.before_until,
                         &place.judged_since, &place.left, &place.absorbed_since})
    *time = bytes->once_in(2) ? static_cast<uint32_t>(bytes->any_int()) : bytes->byte();
  place.passed[0] = bytes->word();
  place.judgement = static_cast<uint8_t>(bytes->below(3));
  place.is_absorbed_news = static_cast<uint8_t>(bytes->below(2));
  return place;
}

Learnt any_learnt(fuzz::Bytes* bytes) {
  Learnt learnt;
  learnt.width = bytes->from(1, 6);
  learnt.height = bytes->from(1, 6);
  const auto pixels = static_cast<size_t>(learnt.width * learnt.height);
  const auto plane = [&] {
    std::vector<uint8_t> samples(pixels);
    for (uint8_t& sample : samples) sample = bytes->byte();
    return samples;
  };
  for (auto& level : learnt.picture.level) level = plane();
  if (bytes->once_in(2)) learnt.limits = plane();
  if (bytes->once_in(2)) {
    auto& earlier = learnt.earlier.emplace();
    for (auto& level : earlier.level) level = plane();
    earlier.spread = plane();
    earlier.rows = bytes->from(1, learnt.height);
    earlier.cols = bytes->from(1, learnt.width);
    const auto cells = static_cast<size_t>(earlier.rows * earlier.cols);
    for (auto* numbers : {&earlier.weight, &earlier.limit, &earlier.looked})
      numbers->assign(cells, static_cast<float>(bytes->byte()));
    if (bytes->once_in(2)) earlier.places.assign(cells, any_place(bytes));
  }
  return learnt;
}

// What was read suits an engine of its size, or is refused by it, and is written as it was read.
void use(Mode mode, Method method, const Learnt& learnt, const Bytes& file) {
  // What an earlier version wrote is written anew.
  QDMD_DEMAND(file[8] < kLearntVersion || pack(learnt) == file);
  if (int64_t{learnt.width} * learnt.height > 64) return;
  EngineOptions options;
  options.mode = mode;
  options.window_size = 3;
  options.threads = 1;
  options.method = method;
  options.colours = learnt.colours;
  Engine engine;
  QDMD_DEMAND(engine.configure(options, learnt.width, learnt.height).ok());
  if (!engine.learn_from(learnt).ok()) return;
  const auto pixels = static_cast<size_t>(learnt.width * learnt.height);
  Bytes frame(3 * pixels, 77), out(3 * pixels);
  ImageView in;
  MutableImageView picture;
  for (size_t c = 0; c < 3; ++c) {
    in.channel[c] = frame.data() + c * pixels;
    picture.channel[c] = out.data() + c * pixels;
  }
  in.width = picture.width = learnt.width;
  in.height = picture.height = learnt.height;
  in.pixel_stride = picture.pixel_stride = 1;
  in.row_stride = picture.row_stride = learnt.width;
  const auto take = [&](int t) {
    while (engine.next()) engine.next()->pop(t % 2 ? Output::mask : Output::background, picture);
  };
  for (int t = 0; t < 8; ++t) {
    QDMD_DEMAND(engine.push(in).ok());
    take(t);
  }
  QDMD_DEMAND(engine.drain().ok());
  take(0);
  Learnt again;
  QDMD_DEMAND(engine.learnt(&again));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Bytes bytes(data, size);
  Bytes file;
  const int kind = bytes.below(4);
  if (kind == 0) {
    const std::string all = bytes.rest();
    file.assign(all.begin(), all.end());
  } else {
    file = pack(any_learnt(&bytes));
    // Numbers of the header and of the rest are lied about, in a file that is sound otherwise.
    for (int lies = bytes.below(4); lies > 0; --lies) {
      const size_t at = bytes.once_in(2) ? static_cast<size_t>(bytes.below(14)) * 4 : bytes.byte();
      put(&file, at, static_cast<uint32_t>(bytes.any_int()), bytes.once_in(2) ? 4 : 1);
    }
    if (bytes.once_in(4)) file.resize(file.size() - std::min<size_t>(file.size(), bytes.byte()));
    if (kind > 1) put_checksum(&file);
  }
  const uint64_t said = bytes.once_in(8) ? bytes.word() : file.size();
  const size_t seen = std::min(file.size(), kLearntHeaderBytes);
  const Status header = check_header({file.data(), seen}, said);
  QDMD_DEMAND(header.ok() || !header.message.empty());

  Learnt learnt;
  learnt.width = -5;
  const Status status = unpack(file, &learnt);
  if (status.ok()) {
    const auto method = static_cast<Method>(bytes.below(3));
    use(bytes.once_in(2) ? Mode::live : Mode::batch, method, learnt, file);
  } else {
    QDMD_DEMAND(status.code == Status::Code::bad_file && !status.message.empty());
    QDMD_DEMAND(learnt.width == -5);
  }
  return 0;
}
