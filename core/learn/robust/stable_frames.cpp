// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/stable_frames.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/learn/robust/clutter.h"
#include "core/learn/robust/compare_contours.h"
#include "core/learn/robust/learning_steps.h"
#include "core/passes/patch_density.h"

namespace qdmd {
namespace {

using namespace steps::start;

// Adds the recollection's look to the density of `count` frames. False, and nothing is added, where
// too little of it is seen in any new frame.
bool add_recollection(size_t cells, PatchFrames* patches, int count, const Recollection& earlier,
                      Pool* pool, std::span<float> density) {
  std::vector<float> rooms(cells * pool->threads());
  float* of_earlier = density.data() + static_cast<size_t>(count) * cells;
  std::fill_n(of_earlier, cells, 0.0f);
  // what(t, alike, first, end) for frames first_frame .. end_frame - 1 at the cells of each part.
  const auto compare = [&](int first_frame, int end_frame, const auto& what) {
    pool->run(static_cast<size_t>(patches->parts()), [&](size_t index, size_t worker) {
      const int part = static_cast<int>(index);
      float* const alike = rooms.data() + worker * cells;
      for (int t = first_frame; t < end_frame; ++t) {
        patches->alike(t, count, part, worker, alike);
        what(t, alike, patches->first_cell(part), patches->first_cell(part + 1));
      }
    });
  };
  const auto add = [&](int, const float* alike, size_t first, size_t end) {
    for (size_t cell = first; cell < end; ++cell) of_earlier[cell] += alike[cell];
  };
  compare(earlier.older_frames, count, add);
  const auto seen = std::count_if(of_earlier, of_earlier + cells,
                                  [](float frames_alike) { return frames_alike > 0; });
  if (static_cast<float>(seen) < kLeastSeen * static_cast<float>(cells)) return false;
  compare(0, earlier.older_frames, add);
  compare(0, count, [&](int t, const float* alike, size_t first, size_t end) {
    float* of_frame = density.data() + static_cast<size_t>(t) * cells;
    for (size_t cell = first; cell < end; ++cell)
      of_frame[cell] += earlier.weight[cell] * alike[cell];
  });
  for (size_t cell = 0; cell < cells; ++cell) of_earlier[cell] += earlier.weight[cell];
  return true;
}

// Each cell's look with the largest density, the first one of equals.
std::vector<int> densest(std::span<const float> density, size_t cells, Pool* pool) {
  // Cells at a time: theirs stay in registers and in the first cache.
  constexpr size_t kTogether = 256;
  std::vector<int> from(cells, 0);
  pool->run((cells + kTogether - 1) / kTogether, [&](size_t part) {
    const size_t first = part * kTogether, count = std::min(kTogether, cells - first);
    float most[kTogether];
    int look[kTogether] = {};
    std::copy_n(density.data() + first, count, most);
    for (size_t t = 1; t < density.size() / cells; ++t) {
      const float* const of_frame = density.data() + t * cells + first;
      for (size_t i = 0; i < count; ++i) {
        look[i] = of_frame[i] > most[i] ? static_cast<int>(t) : look[i];
        most[i] = std::max(most[i], of_frame[i]);
      }
    }
    std::copy_n(look, count, from.data() + first);
  });
  return from;
}

// What hides most of the picture is recognized by its colours; with a better background these are
// known better.
void leave_clutter_out(const Grid& grid, const GridPictures& frames, int count,
                       std::span<const float> density, std::vector<int>* from, Pool* pool,
                       StableFramesRoom* room) {
  ClutterColours colours(grid, frames, count, pool);
  if (!colours.hides_much(density, *from)) return;
  // Steps are not needed meanwhile, and this takes less.
  LargeVector<uint16_t>().swap(room->steps);
  for (int round = 0; round < steps::clutter::kRounds; ++round) {
    colours.learn(*from);
    *from = densest(colours.weigh(density), grid.cells(), pool);
  }
}

// How far two frames are from each other at a cell: levels, sum of the channels.
float apart(const GridPictures& frames, int a, int b, size_t cell) {
  float sum = 0;
  for (int c = 0; c < kChannels; ++c)
    sum += std::abs(frames.plane(a, c)[cell] - frames.plane(b, c)[cell]);
  return sum;
}

// Where contours chose another look than the one that most frames show.
void note_rejected(const GridPictures& frames, int looks, std::span<const int> most_shown,
                   std::span<const int> from, StableFrames* stable) {
  const float most = kChannels * steps::contours::kLooksDiffer;
  const auto is_other = [&](size_t cell) {
    return apart(frames, from[cell], most_shown[cell], cell) > most;
  };
  size_t count = 0;
  for (size_t cell = 0; cell < from.size(); ++cell) count += is_other(cell) ? 1 : 0;
  stable->rejected = Rejected(count, static_cast<size_t>(looks));
  for (size_t cell = 0; cell < from.size(); ++cell) {
    if (!is_other(cell)) continue;
    const auto shown = stable->of_cell[cell];
    stable->rejected.add(static_cast<int>(cell), [&](size_t t) {
      const auto at = static_cast<int>(t);
      return !std::binary_search(shown.begin(), shown.end(), static_cast<uint16_t>(t)) &&
             apart(frames, at, most_shown[cell], cell) < apart(frames, at, from[cell], cell);
    });
  }
}

// The bytes of the room's steps.
uint64_t steps_bytes(const Grid& grid, uint64_t looks) {
  return sizeof(uint16_t) *
         std::max(PatchFrames::steps_of(grid, looks), patch_distance_steps(grid, looks));
}

// How far a frame that shows the background may be: distance, of all frames less one. scratch: as
// many.
float limit_of(std::span<const float> distance, size_t left_out, std::span<float> scratch) {
  const size_t others = distance.size() - (left_out < distance.size() ? 1 : 0);
  const auto nearest = static_cast<size_t>(kNearest * static_cast<double>(others - 1));
  const float kLeast = kSimilar * kAlways;
  // Where enough frames are near, it is no matter how near.
  size_t near = 0;
  for (float d : distance) near += kNear * d <= kLeast ? 1 : 0;
  if (left_out < distance.size() && kNear * distance[left_out] <= kLeast) --near;
  if (near > nearest) return kLeast;
  std::copy(distance.begin(), distance.end(), scratch.begin());
  if (left_out < distance.size()) std::swap(scratch[left_out], scratch[others]);
  std::nth_element(scratch.begin(), scratch.begin() + static_cast<ptrdiff_t>(nearest),
                   scratch.begin() + static_cast<ptrdiff_t>(others));
  return std::max(kLeast, kNear * scratch[nearest]);
}

}  // namespace

StableFrames find_stable_frames(const Grid& grid, const GridPictures& frames, int count,
                                const Recollection* earlier, Pool* pool,
                                const FirstLooks& first_looks, StableFramesRoom* room,
                                std::span<const uint8_t> held) {
  StableFramesRoom own_room;
  if (!room) room = &own_room;
  const size_t cells = grid.cells();
  const size_t most = cells * static_cast<size_t>(count + (earlier ? 1 : 0));
  // Threads touch what is theirs.
  make_room(&room->density, most);
  std::span<float> density(room->density);
  StableFrames result;
  {
    PatchFrames patches(grid, frames, count + (earlier ? 1 : 0), pool, &room->steps);
    patches.density(count, pool, density.data());
    if (earlier && !add_recollection(cells, &patches, count, *earlier, pool, density)) {
      result.another_scene = true;
      earlier = nullptr;
      density = density.first(cells * static_cast<size_t>(count));
    }
  }
  const int looks = count + (earlier ? 1 : 0);
  const auto counts = [&](size_t cell, int t) {
    if (first_looks.from.empty()) return true;
    return t == count ? first_looks.earlier_counts[cell] != 0 : t >= first_looks.from[cell];
  };
  const auto counts_all = [&](size_t cell) {
    return first_looks.from.empty() ||
           (first_looks.from[cell] == 0 && first_looks.earlier_counts[cell] != 0);
  };
  if (!first_looks.from.empty())
    for (size_t cell = 0; cell < cells; ++cell) {
      if (counts_all(cell)) continue;
      for (int t = 0; t < looks; ++t)
        if (!counts(cell, t)) density[static_cast<size_t>(t) * cells + cell] = 0;
    }
  std::vector<int> from = densest(density, cells, pool);
  // What was absorbed is the background of a part of the frames only.
  if (!first_looks.absorbed) leave_clutter_out(grid, frames, count, density, &from, pool, room);
  std::vector<uint8_t> known(cells);
  for (size_t cell = 0; earlier && cell < earlier->share.size(); ++cell) {
    const bool keeps = !held.empty() && held[cell] && earlier->share[cell] >= kHeld;
    if (keeps) from[cell] = count;
    known[cell] = keeps || earlier->share[cell] >= kKnown;
  }
  const std::vector<int> most_shown = from;
  compare_contours(grid, {frames, count, density, known, counts}, &from);

  make_room(&room->distance, cells * static_cast<size_t>(looks));
  const uint16_t* const distance = room->distance.data();
  patch_distance(grid, frames, looks, from.data(), pool, room->distance.data(), &room->steps);
  result.of_cell = FrameLists(cells, looks);
  result.limit.resize(cells);
  const auto all = static_cast<size_t>(count), cols = static_cast<size_t>(grid.cols);
  const size_t each = static_cast<size_t>(looks) + all;
  std::vector<float> rooms(each * pool->threads());
  pool->run(static_cast<size_t>(grid.rows), [&](size_t row, size_t worker) {
    float *of_cell = rooms.data() + worker * each, *scratch = of_cell + looks;
    for (size_t col = 0; col < cols; ++col) {
      const size_t cell = row * cols + col;
      const auto steps =
          static_cast<float>(kChannels * kStepsPerLevel *
                             patch_cells(grid, static_cast<int>(row), static_cast<int>(col)));
      for (size_t t = 0; t < static_cast<size_t>(looks); ++t)
        of_cell[t] = static_cast<float>(distance[cell * static_cast<size_t>(looks) + t]) / steps;
      // A frame is not its own neighbour, but of two it would be wrong to trust the other.
      const auto left_out = count > 2 ? static_cast<size_t>(from[cell]) : all;
      float limit = limit_of({of_cell, all}, left_out, {scratch, all});
      // No frame of the window need show what an earlier one did.
      if (earlier && (from[cell] == count || from[cell] < earlier->older_frames))
        limit = std::min(limit, earlier->limit[cell]);
      result.limit[cell] = limit;
      if (counts_all(cell))
        result.of_cell.take(cell, [&](size_t t) { return of_cell[t] <= limit; });
      else
        result.of_cell.take(cell, [&](size_t t) {
          return of_cell[t] <= limit && counts(cell, static_cast<int>(t));
        });
      // Beside other frames' looks none may be near enough: what was chosen shows it all the same.
      if (result.of_cell[cell].empty()) result.of_cell.add(cell, from[cell]);
    }
  });
  note_rejected(frames, looks, most_shown, from, &result);
  return result;
}

uint64_t stable_frames_bytes(const Grid& grid, uint64_t looks, int threads) {
  const uint64_t rooms = sizeof(float) * static_cast<uint64_t>(threads) * grid.cells();
  const uint64_t patches = PatchFrames::bytes(grid, looks, threads) -
                           sizeof(uint16_t) * PatchFrames::steps_of(grid, looks);
  const uint64_t clutter = ClutterColours::bytes(grid, looks, threads);
  // The lists are made beside those of the solve before.
  return std::max({patches + rooms, clutter - std::min(clutter, steps_bytes(grid, looks)),
                   StableFrames::bytes(grid, looks)});
}

StableFramesRoom::StableFramesRoom(const Grid& grid, uint64_t looks) {
  density.reserve(looks * grid.cells());
  steps.reserve(steps_bytes(grid, looks) / sizeof(uint16_t));
  distance.reserve(looks * grid.cells());
}

uint64_t StableFramesRoom::bytes(const Grid& grid, uint64_t looks) {
  return looks * grid.cells() * (sizeof(float) + sizeof(uint16_t)) + steps_bytes(grid, looks);
}

}  // namespace qdmd
