// SPDX-License-Identifier: LGPL-2.1-or-later
// Steps of a decision that look at the parts of its mask.
#include "core/foreground/decision.h"

#include <algorithm>

#include "core/foreground/edges.h"
#include "core/passes/bands.h"

namespace qdmd {

ComparedPlanes Decision::planes() const {
  ComparedPlanes planes;
  for (int c = 0; c < kChannels; ++c) {
    planes.x[c] = now_.frame.x[c].high;
    planes.l[c] = of_.level[c].data() + shape_.offset(0);
  }
  planes.x_stride = static_cast<size_t>(shape_.width);
  planes.l_stride = shape_.stride;
  return planes;
}

// share: of the picture.
void Decision::take_out_specks(uint8_t colour, double share) {
  if (!steps_.specks || shape_.reach == 0) return;
  const double least = share * static_cast<double>(shape_.pixels());
  specks_.take_out(of_.mask.data(), colour, static_cast<size_t>(least), colour == 255);
}

// Before a camera that shakes, what is seen is the background beside its place: it has the
// background's texture, in any light.
bool Decision::much_moves() const {
  const auto cells = static_cast<size_t>(texture_.grid().rows * texture_.grid().cols);
  size_t moving = 0;
  for (size_t cell = 0; cell < cells; ++cell) moving += moves(cell);
  return static_cast<double>(moving) > constants().hard.most_moving * static_cast<double>(cells);
}

void Decision::leave_hard_shadows() {
  const bool marked = now_.frame.shadows == Shadows::marked;
  const bool any = hard_.take_out(planes(), rgb_, black_, now_.pool, of_.mask.data(),
                                  marked ? of_.shaded.data() : nullptr);
  // Outlines of shadows are left.
  if (any) take_out_specks(255, constants().least_foreground);
}

// What differs, and what is foreground before the vote, is known no longer.
void Decision::leave_edges() {
  const EdgeView view = {planes(), shape_.width, shape_.height, of_.mask.data(), foreground_row(0)};
  uint8_t* const fitted = differing_row(0);
  const auto in_rows = [&](const auto& work) {
    for_rows(now_.pool, shape_.height, shape_.pixels(), work);
  };
  in_rows([&](int first, int size) { find_inside(view, first, size); });
  in_rows([&](int first, int size) { fit_edges(view, constants().edges, first, size, fitted); });
  in_rows([&](int first, int size) {
    for (int y = first; y < first + size; ++y)
      std::copy_n(differing_row(y), shape_.width, of_.mask.data() + shape_.first(y));
  });
}

}  // namespace qdmd
