// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/scene_memory.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/learn/robust/colour_map.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/near_cells.h"
#include "core/learn/robust/places.h"

namespace qdmd {
namespace {

using namespace steps::proofs;

double balance(double a, double b, double least) { return (a - b) / (a + b + least); }

// The element that so large a share of the others is below.
int64_t at_share(std::vector<int64_t>* of, double share) {
  const auto at = of->begin() + static_cast<ptrdiff_t>(share * static_cast<double>(of->size() - 1));
  std::nth_element(of->begin(), at, of->end());
  return *at;
}

}  // namespace

SceneMemory::SceneMemory(const Grid& grid, bool live)
    : grid_(grid),
      looks_(grid),
      uncovered_(grid.cells()),
      said_(grid.cells()),
      shown_(grid.cells()),
      differs_(grid.cells()),
      unjudged_(grid.cells()),
      marks_(grid.cells()),
      young_frames_(live ? kYoungFrames : 0),
      settled_(live ? kSettledOfLive : kSettled) {
  found_.reserve(grid.cells());
  around_.reserve(grid.cells());
  differing_.reserve(grid.cells());
}

uint64_t SceneMemory::bytes(const Grid& grid) {
  const uint64_t cells = grid.cells();
  return StandingLooks::bytes(grid) + HistoryStarts::bytes(cells) + Judgements::bytes(cells) +
         ShownCounts::bytes(cells) + cells * (3 * sizeof(uint8_t) + 3 * sizeof(int));
}

void SceneMemory::forget() {
  followed_ = 0;
  looks_.forget();
  uncovered_.forget();
  said_.forget();
  shown_.forget();
  std::fill(differs_.begin(), differs_.end(), uint8_t{0});
  news_ = false;
  stood_until_ = StandingLooks::kNever;
}

void SceneMemory::find_standing(std::vector<uint8_t>* stands) const {
  for (size_t cell = 0; cell < differs_.size(); ++cell)
    (*stands)[cell] = differs_[cell] && of(static_cast<int>(cell)) != Of::left;
}

void SceneMemory::begin_colours(const std::vector<uint8_t>& stands) {
  const int64_t now = looks_.newest();
  forget();
  grow_up();
  // Its look in these colours is yet to come.
  stood_until_ = now + StandingLooks::kSteady;
  for (size_t cell = 0; cell < stands.size(); ++cell)
    if (stands[cell]) said_.decide(static_cast<int>(cell), Of::came, stood_until_);
}

// What stood there may have gone together with the colours.
void SceneMemory::forget_what_went() {
  if (looks_.newest() > stood_until_ + StandingLooks::kSteady) return;
  for (size_t cell = 0; cell < differs_.size(); ++cell) {
    const int at = static_cast<int>(cell);
    if (!differs_[cell] && looks_.shows_look(at) && of(at) == Of::came)
      said_.decide(at, Of::none, looks_.since(at));
  }
}

void SceneMemory::write(size_t cell, int64_t now, LearntPlace* out) const {
  const int at = static_cast<int>(cell);
  looks_.write(cell, now, out);
  said_.write(at, now, looks_.since(at), uncovered_.is_news(at), out);
}

bool SceneMemory::read(size_t cell, int64_t now, const LearntPlace& from) {
  if (!looks_.read(cell, now, from)) return false;
  const int at = static_cast<int>(cell);
  said_.read(at, now, from);
  if (from.judgement == LearntPlace::kLeft) uncovered_.add(at, said_.since(at));
  return true;
}

// Quarters of the cells may be earlier and later: they had something else before them.
SceneMemory::Change SceneMemory::change_of(const std::vector<int>& region) const {
  std::vector<int64_t> last, since;
  for (int cell : region) {
    since.push_back(looks_.since(cell));
    if (looks_.before_until(cell) != StandingLooks::kNever)
      last.push_back(std::min(looks_.before_until(cell), looks_.since(cell)));
  }
  Change change;
  change.known = 2 * last.size() >= region.size();
  change.until = at_share(&since, 0.75);
  change.from = change.known ? std::min(change.until, at_share(&last, 0.25)) : change.until;
  return change;
}

SceneMemory::Motion SceneMemory::motion_around(const std::vector<int>& region,
                                               const Change& change) {
  enum Mark : uint8_t { far, around, beside, near, inside };
  std::fill(marks_.begin(), marks_.end(), uint8_t{far});
  around_.clear();
  for (int cell : region)
    each_near(grid_, cell, 1, [&](int at) { marks_[static_cast<size_t>(at)] = beside; });
  for (int cell : region)
    each_near(grid_, cell, kAround, [&](int at) {
      uint8_t& mark = marks_[static_cast<size_t>(at)];
      if (mark != far) return;
      // Not what changed with it.
      if (std::abs(looks_.since(at) - change.until) <= kAtOnce) return;
      mark = around;
      around_.push_back(at);
    });
  // Something large counts no more than something of the region's size, or than all that is around.
  const auto most =
      static_cast<double>(std::max<size_t>(1, std::min(region.size(), around_.size())));
  const auto mean = [&](int64_t first, int64_t last) {
    double sum = 0;
    for (int64_t t = first; t <= last; ++t) {
      const auto passed = std::count_if(around_.begin(), around_.end(),
                                        [&](int cell) { return looks_.passed(cell, t); });
      sum += std::min(1.0, static_cast<double>(passed) / most);
    }
    return last < first ? 0 : sum / static_cast<double>(last - first + 1);
  };
  for (int cell : region) marks_[static_cast<size_t>(cell)] = inside;
  size_t cells = 0, unsettled = 0;
  for (int cell : region)
    each_near(grid_, cell, kNear, [&](int at) {
      uint8_t& mark = marks_[static_cast<size_t>(at)];
      if (mark == near || mark == inside) return;
      mark = near;
      ++cells;
      unsettled += looks_.passed(at, looks_.newest());
    });
  return {mean(change.from - kMoves + 1, change.from),
          mean(change.until, std::min(looks_.newest(), change.until + kMoves - 1)),
          cells == 0 ? 0 : static_cast<double>(unsettled) / static_cast<double>(cells)};
}

void SceneMemory::decide(const std::vector<int>& region, Of of) {
  for (int cell : region) {
    said_.decide(cell, of, looks_.since(cell));
    if (of != Of::left) continue;
    said_.note_left(cell, looks_.newest());
    uncovered_.add(cell, looks_.since(cell));
  }
}

bool SceneMemory::left_beside(const std::vector<int>& region) const {
  bool found = false;
  for (int cell : region)
    each_near(grid_, cell, 1, [&](int near) {
      if (said_.left(near) == Judgements::kNever) return;
      const int64_t ago = looks_.newest() - said_.left(near);
      if (ago > kPieces) return;
      found |= ago <= kMoves || (looks_.before_until(cell) != StandingLooks::kNever &&
                                 std::abs(looks_.before_until(cell) - said_.since(near)) <= kMoves);
    });
  return found;
}

bool SceneMemory::came_beside(const std::vector<int>& region) const {
  bool found = false;
  for (int cell : region)
    each_near(grid_, cell, 1, [&](int near) { found |= of(near) == Of::came; });
  return found;
}

// True where looks came with that frame, or one next to it, in many places of the picture.
bool SceneMemory::is_all_over(int64_t since) const {
  std::array<bool, kTilesAlong* kTilesAlong> tiles = {};
  for (int row = 0; row < grid_.rows; ++row)
    for (int col = 0; col < grid_.cols; ++col) {
      const int cell = row * grid_.cols + col;
      if (!differs_[static_cast<size_t>(cell)]) continue;
      if (std::abs(looks_.since(cell) - since) > kAtOnce) continue;
      tiles[static_cast<size_t>(row * kTilesAlong / grid_.rows * kTilesAlong +
                                col * kTilesAlong / grid_.cols)] = true;
    }
  return 2 * std::count(tiles.begin(), tiles.end(), true) >= std::ssize(tiles);
}

// stronger: the background's contour, more than kStronger.
bool SceneMemory::has_left(const std::vector<int>& region, const Change& change, double stronger,
                           const Motion& motion) const {
  const double both =
      stronger + (change.known ? kOfMotion * balance(motion.after, motion.before, 0.1) : 0);
  // What comes beside what stands there is mostly a part of it.
  if (motion.near < settled_) return both > (came_beside(region) ? kMuchStronger : kStronger);
  const bool is_clear = region.size() >= kClearRegion && stronger > kClear && both > kClearBoth;
  return stronger > kMuchStronger && both > kMuchStronger &&
         (looks_.newest() - change.until >= 2 * kMoves || is_clear);
}

void SceneMemory::judge(const std::vector<int>& region, const Contours& contours) {
  if (region.size() < kLeastRegion) {
    if (left_beside(region) && !came_beside(region)) decide(region, Of::left);
    return;
  }
  const Change change = change_of(region);
  const int64_t stood = looks_.newest() - change.until;
  const RegionContours contour = contours(region);
  const bool says = contour.pairs >= kLeastPairs && contour.open <= contour.pairs &&
                    contour.background >= kLeastContour;
  const double stronger =
      says ? balance(static_cast<double>(contour.background), static_cast<double>(contour.look), 1)
           : 0;
  // Motion changes nothing where contours do not say that something left.
  if (stronger > kStronger) {
    const Motion motion = motion_around(region, change);
    if (has_left(region, change, stronger, motion)) {
      // A picture that is out of focus has weak contours all over, and nothing went there.
      const bool disturbed = motion.after < kWentOn && stood < kLasts && is_all_over(change.until);
      if (!disturbed) decide(region, Of::left);
      return;
    }
  }
  if (stood >= 3 * kMoves) decide(region, Of::came);
}

const std::vector<int>& SceneMemory::judge(const float* const background[3],
                                           const Contours& contours) {
  found_.clear();
  news_ = false;
  if (std::min(grid_.rows, grid_.cols) < 4) return found_;
  if (young()) {
    const std::vector<int>& left = looks_.uncovered(background);
    news_ = looks_.any_news();
    return left;
  }
  looks_.find_differing(background, &differs_, &differing_);
  shown_.count(looks_, differs_, background);
  forget_what_went();
  const bool any_left =
      said_.newest_left() != Judgements::kNever && looks_.newest() - said_.newest_left() <= kPieces;
  if (differing_.size() < kLeastRegion && (differing_.empty() || !any_left)) return found_;
  const auto news =
      static_cast<size_t>(std::count_if(differing_.begin(), differing_.end(), [&](int at) {
        return looks_.newest() - looks_.since(at) < StandingLooks::kNewsFrames;
      }));
  news_ = news >= StandingLooks::kLeastNews;
  if (is_most_of_picture()) leave_out_shaded(background);
  if (is_most_of_picture()) {
    judge_as_one();
    return found_;
  }
  // What was judged stays so as long as it is there.
  std::fill(unjudged_.begin(), unjudged_.end(), uint8_t{0});
  for (int at : differing_)
    unjudged_[static_cast<size_t>(at)] = said_.renewed(at, looks_.since(at)) == Of::none;
  CellRegions regions(grid_);
  for (const std::vector<int>& region : regions.find(unjudged_)) {
    judge(region, contours);
    if (of(region[0]) == Of::left) found_.insert(found_.end(), region.begin(), region.end());
  }
  if (!found_.empty()) widen(background);
  // What passes before a cell may have hidden what is behind.
  for (int at : differing_)
    if (!unjudged_[static_cast<size_t>(at)] && of(at) == Of::left) found_.push_back(at);
  return found_;
}

bool SceneMemory::is_most_of_picture() const {
  return static_cast<double>(differing_.size()) >=
         kMostOfPicture * static_cast<double>(grid_.cells());
}

// A cloud is no look of its own: masks know the background in less light, by its colours.
void SceneMemory::leave_out_shaded(const float* const background[3]) {
  if (colouring_of(background, nullptr, grid_.cells()) == Colouring::none) return;
  std::erase_if(differing_, [&](int cell) {
    float look = 0, of_background = 0, rest = 0;
    for (int c = 0; c < kChannels; ++c) {
      look += looks_.level(cell, c);
      of_background += background[c][static_cast<size_t>(cell)];
    }
    const float shade = look / std::max(of_background, 1.0f);
    if (shade < kDarkestShade || shade >= 1) return false;
    for (int c = 0; c < kChannels; ++c)
      rest += std::abs(looks_.level(cell, c) - shade * background[c][static_cast<size_t>(cell)]);
    return rest < kShadeRest;
  });
}

// No object changes so much of the picture: the camera was moved, or something disturbs it. What
// lasts is background.
void SceneMemory::judge_as_one() {
  for (int at : differing_) {
    const int64_t since = looks_.since(at);
    if (looks_.newest() - since < kLasts || of(at) == Of::left) continue;
    said_.decide(at, Of::left, since);
    uncovered_.add(at, since);
  }
}

float SceneMemory::apart(int cell, const float* const background[3]) const {
  float sum = 0;
  for (int c = 0; c < kChannels; ++c)
    sum += std::abs(looks_.level(cell, c) - background[c][static_cast<size_t>(cell)]);
  return sum;
}

// What left reaches into the cells around.
void SceneMemory::widen(const float* const background[3]) {
  std::fill(marks_.begin(), marks_.end(), uint8_t{0});
  for (int cell : found_) marks_[static_cast<size_t>(cell)] = 1;
  size_t first = 0;
  for (int step = 0; step < kRim; ++step) {
    const size_t end = found_.size();
    for (size_t i = first; i < end; ++i)
      each_near(grid_, found_[i], 1, [&](int near) {
        const auto at = static_cast<size_t>(near);
        if (marks_[at] || !looks_.shows_look(near)) return;
        if (of(near) == Of::came) return;
        const bool shows_it = apart(near, background) >= StandingLooks::kSame;
        if (step > 0 && !shows_it) return;
        marks_[at] = 1;
        found_.push_back(near);
        if (shows_it) {
          decide({near}, Of::left);
          return;
        }
        // It shows too little of it to have changed its look.
        const int64_t since = said_.since(found_[i]);
        said_.decide(near, Of::left, since);
        uncovered_.add(near, since);
      });
    first = end;
  }
}

void SceneMemory::hand_over(Proofs* solve) {
  solve->any = false;
  solve->young = young();
  std::fill(solve->came.begin(), solve->came.end(), uint8_t{0});
  if (solve->young) return;
  for (size_t cell = 0; cell < marks_.size(); ++cell) {
    const int at = static_cast<int>(cell);
    const Of said = of(at);
    marks_[cell] = said == Of::came || (said == Of::none && shown_.shows_other(cell));
    if (!marks_[cell] || !shown_.is_known(cell, looks_.newest() - looks_.since(at) + 1)) {
      marks_[cell] = 0;
      continue;
    }
    solve->any = true;
    solve->came[cell] = 1;
    solve->since[cell] = said == Of::came ? looks_.since(at) : Proofs::kUnsure;
  }
  // What stands there reaches into the cells around.
  for (size_t cell = 0; cell < marks_.size(); ++cell)
    if (marks_[cell])
      each_near(grid_, static_cast<int>(cell), kRim, [&](int near) {
        const auto at = static_cast<size_t>(near);
        if (solve->came[at] || of(near) == Of::left) return;
        solve->came[at] = 1;
        solve->since[at] = solve->since[cell];
      });
}

}  // namespace qdmd
