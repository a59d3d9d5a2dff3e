#include "core/learn/robust/look_ahead.h"

#include <algorithm>

namespace qdmd {
namespace {

// What stood there is what so many of the window's frames show, percent, mean of a region. A
// background between leaves, of which each of its cells is seen in a third of the frames, is none.
constexpr int kStood = 40;

}  // namespace

LookAhead::LookAhead(const Grid& grid) : looks_(grid), percent_(grid.cells()) {}

void LookAhead::forget() {
  looks_.forget();
  state_ = State::before;
}

void LookAhead::publish(bool first, const StableFrames& stable, int frames) {
  state_ = first && state_ == State::before ? State::first_window : State::over;
  if (state_ == State::over) return;
  for (size_t cell = 0; cell < percent_.size(); ++cell)
    percent_[cell] = static_cast<uint8_t>(100 * stable.of_cell[cell].size() /
                                          static_cast<size_t>(std::max(frames, 1)));
}

const std::vector<int>& LookAhead::uncovered(const float* const background[3]) {
  const auto stood = [this](const std::vector<int>& region) {
    size_t sum = 0;
    for (int cell : region) sum += percent_[static_cast<size_t>(cell)];
    return sum >= kStood * region.size();
  };
  const std::vector<int>& cells = looks_.uncovered(background, stood);
  // A camera that was moved makes other looks everywhere, some of which happen to fit.
  static const std::vector<int> none;
  return 2 * cells.size() < looks_.differing() ? none : cells;
}

}  // namespace qdmd
