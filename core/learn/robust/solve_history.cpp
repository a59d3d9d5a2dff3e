// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/solve_history.h"

#include <algorithm>
#include <limits>

namespace qdmd {
namespace {

// Sets bits first .. end - 1.
void set_bits(size_t first, size_t end, uint8_t* bits) {
  while (first < end) {
    const size_t at = first % 8, count = std::min(8 - at, end - first);
    bits[first / 8] |= static_cast<uint8_t>(((1u << count) - 1) << at);
    first += count;
  }
}

}  // namespace

void set_cell(const Grid& grid, int cell, uint8_t* bits) {
  const int row = cell / grid.cols, col = cell % grid.cols;
  for (int y = grid.top(row); y < grid.top(row + 1); ++y) {
    const size_t line = static_cast<size_t>(y) * static_cast<size_t>(grid.width);
    set_bits(line + static_cast<size_t>(grid.left(col)),
             line + static_cast<size_t>(grid.left(col + 1)), bits);
  }
}

void SolveHistory::begin() {
  const size_t cells = context_.grid.cells();
  absorbed_ = uncovered_ = HistoryStarts(cells);
  proofs_ = Proofs(cells);
  held_.reserve(cells);
}

void SolveHistory::forget() {
  absorbed_.forget();
  uncovered_.forget();
  proofs_.any = false;
  disturbances_.forget();
}

void SolveHistory::take(HistoryStarts* absorbed, SceneMemory* memory,
                        const Disturbances& disturbances) {
  absorbed->hand_over(&absorbed_);
  disturbances_ = disturbances;
  if (!context_.follows(context_.room.models)) return;
  memory->uncovered().hand_over(&uncovered_);
  memory->hand_over(&proofs_);
}

FirstLooks SolveHistory::first_looks(const std::vector<int64_t>& numbers, bool earlier_known) {
  FirstLooks looks;
  if (absorbed_.any() || uncovered_.any()) looks = FirstLooks(context_.grid.cells());
  looks.absorbed = absorbed_.any();
  held_.assign(context_.grid.cells(), 0);
  known_foreground_.clear();
  for (const HistoryStarts* starts : {&absorbed_, &uncovered_}) {
    if (!starts->any()) continue;
    starts->leave_out(numbers, &looks);
    for (int cell = 0; cell < static_cast<int>(context_.grid.cells()); ++cell)
      if (starts->since(cell) > numbers.front())
        known_foreground_.push_back({cell, HistoryStarts::kNever, starts->since(cell) - 1});
  }
  if (!proofs_.any || !earlier_known) return looks;
  for (size_t cell = 0; cell < context_.grid.cells(); ++cell) {
    const int at = static_cast<int>(cell);
    // What was absorbed is background, until it leaves.
    held_[cell] = proofs_.came[cell] && !absorbed_.has(at);
    if (held_[cell])
      known_foreground_.push_back({at, proofs_.since[cell], std::numeric_limits<int64_t>::max()});
  }
  return looks;
}

void SolveHistory::take_out(int64_t number, uint8_t* bits) const {
  for (const KnownForeground& known : known_foreground_)
    if (number >= known.first && number <= known.last) set_cell(context_.grid, known.cell, bits);
}

}  // namespace qdmd
