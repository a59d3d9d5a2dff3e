// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/vote.h"

#include <algorithm>
#include <cstring>

#include "core/passes/combine.h"
#include "core/passes/majority.h"

namespace qdmd {

int voting_reach(int width, int height) {
  return std::min(kMostReach, std::min(width, height) / 120);
}

void vote(const Voters& voters, int first_row, int row_count, uint8_t* out) {
  const int reach = voters.reach;
  const auto row_of = [&](int y) { return voters.mask + static_cast<size_t>(y) * voters.stride; };
  const auto out_of = [&](int y) {
    return out + static_cast<size_t>(y) * static_cast<size_t>(voters.width);
  };
  const auto width = static_cast<size_t>(voters.width);
  if (reach == 0) {
    for (int y = first_row; y < first_row + row_count; ++y)
      std::memcpy(out_of(y), row_of(y), width);
    return;
  }
  constexpr int kRows = 2 * kMostReach + 1;
  alignas(64) uint8_t counts[kRows][kMaxRun];
  for (size_t left = 0; left < width; left += kMaxRun) {
    const size_t count = std::min(kMaxRun, width - left);
    int counted = std::max(0, first_row - reach);
    for (int y = first_row; y < first_row + row_count; ++y) {
      for (const int end = std::min(voters.height, y + reach + 1); counted < end; ++counted)
        count_columns(row_of(counted) + left - reach, count, reach, counts[counted % kRows]);
      const uint8_t* around[kRows];
      for (int i = 0; i <= 2 * reach; ++i)
        around[i] = counts[std::clamp(y + i - reach, 0, voters.height - 1) % kRows];
      vote_row(around, row_of(y) + left, count, reach, out_of(y) + left);
    }
  }
}

}  // namespace qdmd
