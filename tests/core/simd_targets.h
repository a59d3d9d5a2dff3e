// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs a check once for each instruction set that this machine has and the passes are built for.
#pragma once

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>

// As in core/passes/simd.h: without it the list would name targets that no pass is built for.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/targets.h>

namespace qdmd::test {

template <typename Check>
void on_every_target(Check check) {
  for (int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(target);
    check();
    if (testing::Test::HasFatalFailure()) break;
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

// Memory that ends where an inaccessible page begins: whoever reads or writes one byte too many is
// killed on the spot.
template <typename T>
class BeforeTheEdge {
 public:
  explicit BeforeTheEdge(size_t count) : count_(count) {
    const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
    const size_t bytes = count * sizeof(T);
    const size_t used = (bytes + page - 1) / page * page;
    mapped_ = used + page;
    base_ = static_cast<char*>(
        mmap(nullptr, mapped_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    EXPECT_NE(static_cast<void*>(base_), MAP_FAILED);
    EXPECT_EQ(mprotect(base_ + used, page, PROT_NONE), 0);
    data_ = reinterpret_cast<T*>(base_ + used - bytes);
  }
  ~BeforeTheEdge() { munmap(base_, mapped_); }
  BeforeTheEdge(const BeforeTheEdge&) = delete;
  BeforeTheEdge& operator=(const BeforeTheEdge&) = delete;

  T* data() { return data_; }
  size_t size() const { return count_; }
  T& operator[](size_t i) { return data_[i]; }
  T* begin() { return data_; }
  T* end() { return data_ + count_; }

 private:
  size_t count_, mapped_ = 0;
  char* base_ = nullptr;
  T* data_ = nullptr;
};

}  // namespace qdmd::test
