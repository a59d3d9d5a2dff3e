// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/align/motion.h"

#include <algorithm>
#include <cmath>

namespace qdmd {
namespace {

constexpr int kLandmarks = 1024, kLandmarksAbove = 512;
// Pixels along the short side of the pyramid's top, at least.
constexpr int kTop = 20;
// So many of 4 x 4 parts of the picture must have landmarks.
constexpr int kFewestParts = 7;
// Pixels below which the camera is at rest.
constexpr double kRest = 0.1;
// Standard deviations by which a shift must be known.
constexpr double kSure = 4;
// What is searched in each direction, as a share of the picture's longer side.
constexpr double kReach = 1.0 / 8;
// Less agreement than this is none.
constexpr double kLeastAgree = 0.25;
// Who moved fits at least so much.
constexpr double kMovedAgree = 0.45;
// At rest so many fit in one look; fewer, and somebody stands before more than half of them.
constexpr double kRestAgree = 0.45;
// Nobody looks further where so much fits next to rest.
constexpr double kAtOnce = 0.75;
// More than that is another view, and more than resample() does.
constexpr double kMostAngle = 0.06, kMostGrowth = 0.05;
// Levels: the most that frames may differ by from the first reference.
constexpr double kMostNoise = 12;
// Frames of which so much fits tell the noise.
constexpr double kTypical = 0.6;
// The share of the landmarks by which a pose must fit better than another one; less where they are
// nearer than a pixel and kNear. Where they are kFar pixels apart or more, little of what fitted
// can fit still: leaves near the camera, of which many move alike, leave more. The share grows to
// that from half of kFar on.
constexpr double kClearly = 0.1, kNear = 0.3, kFarClearly = 0.2, kFar = 8;
// A light that differs by more, a share and levels, moves edges at the end of samples' range.
constexpr double kOtherGain = 0.03, kOtherOffset = 4;
// Levels: frames that differ by more from the first reference may have been moved.
constexpr double kFirstNoise = 4;

// So much of another light that samples at the end of their range show other edges.
bool changes_edges(const GreyLight& light) {
  return std::abs(light.gain) > kOtherGain || std::abs(light.offset) > kOtherOffset;
}

Pose at_level(const Pose& pose, size_t level) {
  const double share = std::ldexp(1.0, -static_cast<int>(level));
  return {pose.x * share, pose.y * share, pose.angle, pose.scale};
}

void halve(const uint8_t* from, int from_width, int width, int height, uint8_t* to) {
  for (int y = 0; y < height; ++y) {
    const uint8_t* const a = from + ptrdiff_t{2} * y * from_width;
    const uint8_t* const b = a + from_width;
    uint8_t* const out = to + ptrdiff_t{y} * width;
    for (int x = 0; x < width; ++x)
      out[x] = static_cast<uint8_t>((a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1] + 2) / 4);
  }
}

}  // namespace

MotionFinder::MotionFinder(int width, int height) {
  for (int k = 0; k == 0 || std::min(width, height) >= kTop; ++k, width /= 2, height /= 2) {
    const size_t samples = k == 0 ? 0 : static_cast<size_t>(width) * static_cast<size_t>(height);
    levels_.push_back({width, height, std::vector<uint8_t>(samples),
                       Landmarks(k == 0 ? kLandmarks : kLandmarksAbove)});
  }
}

uint64_t MotionFinder::bytes(int width, int height) {
  uint64_t bytes = Landmarks::bytes(kLandmarks);
  for (width /= 2, height /= 2; std::min(width, height) >= kTop; width /= 2, height /= 2)
    bytes += static_cast<uint64_t>(width) * static_cast<uint64_t>(height) +
             Landmarks::bytes(kLandmarksAbove);
  return bytes;
}

void MotionFinder::forget() {
  known_ = false;
  light_ = {};
  noise_ = 0;
}

void MotionFinder::build(const uint8_t* grey) {
  for (size_t k = 1; k < levels_.size(); ++k)
    halve(k == 1 ? grey : levels_[k - 1].picture.data(), levels_[k - 1].width, levels_[k].width,
          levels_[k].height, levels_[k].picture.data());
}

GreyView MotionFinder::view(size_t level, const uint8_t* grey) const {
  const Level& at = levels_[level];
  return {level == 0 ? grey : at.picture.data(), at.width, at.height};
}

void MotionFinder::take_reference(const uint8_t* grey, const IgnoredAreas& ignored) {
  build(grey);
  for (size_t k = 0; k < levels_.size(); ++k)
    levels_[k].marks.choose(view(k, grey), ignored, 1 << k);
  const Landmarks& marks = levels_[0].marks;
  blank_ = marks.count() < Landmarks::kFewest || marks.parts() < kFewestParts;
  light_ = {};
  known_ = true;
}

// The whole shift of the pyramid's top at which most landmarks fit. In doubt, the one before.
Pose MotionFinder::search(const uint8_t* grey, const Pose& before) const {
  const size_t top = levels_.size() - 1;
  const Level& at = levels_[top];
  // Half a pixel beside, edges are some levels off.
  const double limit = std::max(8.0, 2 * noise_);
  const Pose start = at_level(before, top);
  const auto x = static_cast<int>(std::lround(start.x)), y = static_cast<int>(std::lround(start.y));
  const GreyView frame = view(top, grey);
  constexpr double kDoubt = 0.03;
  double best = at.marks.share_within(frame, x, y, light_, limit) + kDoubt;
  Pose found = before;
  const int reach = static_cast<int>(std::ceil(kReach * std::max(at.width, at.height)));
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      const double share = at.marks.share_within(frame, dx, dy, light_, limit);
      if (share <= best) continue;
      best = share;
      found = before;
      found.x = std::ldexp(dx, static_cast<int>(top));
      found.y = std::ldexp(dy, static_cast<int>(top));
    }
  return found;
}

// Steps until one is shorter than `enough` pixels of the level.
Fit MotionFinder::refine(size_t level, const uint8_t* grey, Pose pose, bool turns, int steps,
                         double enough) {
  Level& at = levels_[level];
  const GreyView frame = view(level, grey);
  Fit fit;
  fit.pose = at_level(pose, level);
  fit.light = light_;
  for (int i = 0; i < steps; ++i) {
    const Fit next = at.marks.step(frame, fit.pose, fit.light, turns);
    if (!next.known) break;
    const double way = largest_way(next.pose, fit.pose, at.width, at.height);
    fit = next;
    if (way < enough) break;
  }
  const double factor = std::ldexp(1.0, static_cast<int>(level));
  fit.pose.x *= factor;
  fit.pose.y *= factor;
  fit.error *= factor;
  return fit;
}

// From the top of the pyramid down.
Fit MotionFinder::find_afar(const uint8_t* grey, const Pose& before, bool turns) {
  build(grey);
  Fit fit;
  fit.pose = search(grey, before);
  for (size_t k = levels_.size(); k-- > 0;) {
    const Fit next = refine(k, grey, fit.pose, turns, k == 0 ? 8 : 4, k == 0 ? 0.005 : 0.02);
    if (next.known) fit = next;
  }
  return fit;
}

Motion MotionFinder::find(const uint8_t* grey, const Pose& before, const Pose& rest, bool turns) {
  Motion motion;
  if (!known_) return motion;
  const Level& full = levels_[0];
  const auto at_rest = [&](const Fit& fit) {
    return largest_way(fit.pose, rest, full.width, full.height) <
           std::max(kRest, kSure * fit.error);
  };
  const auto settle = [&](const Fit& fit, const Pose& pose) {
    motion.pose = pose;
    motion.agree = fit.agree;
    motion.found = true;
    light_ = fit.light;
    // Crowds are no noise.
    if (noise_ == 0)
      noise_ = std::min(fit.noise, kMostNoise);
    else if (fit.agree >= kTypical)
      noise_ += 0.1 * (std::min(fit.noise, 1.5 * noise_) - noise_);
    return motion;
  };
  Landmarks& marks = levels_[0].marks;
  light_.is_other = changes_edges(light_);
  Fit look = marks.step(view(0, grey), rest, light_, turns);
  // Where most is too bright to say anything, the reference's own light may be back.
  if (!blank_ && !look.known && light_.is_other) {
    if (look.light_known) light_ = look.light;
    const Fit same = marks.step(view(0, grey), rest, GreyLight(), turns);
    if (same.known && same.agree >= kRestAgree && same.noise < 1 + 1.5 * noise_) look = same;
  }
  // A picture without edges shows no motion.
  if (blank_ || !look.known) {
    motion.pose = rest;
    motion.found = true;
    return motion;
  }
  const bool quiet = noise_ == 0 ? look.noise < kFirstNoise : look.noise < 1 + 1.5 * noise_;
  if (quiet && look.agree >= kRestAgree && at_rest(look)) return settle(look, rest);

  const bool near = quiet && look.agree >= kRestAgree &&
                    largest_way(look.pose, rest, full.width, full.height) < 1;
  Fit fit;
  if (near) fit = refine(0, grey, rest, turns, 4, 0.01);
  if (!fit.known || fit.agree < kAtOnce) fit = find_afar(grey, before, turns);
  if (!fit.known || std::abs(fit.pose.angle) > kMostAngle ||
      std::abs(fit.pose.scale - 1) > kMostGrowth)
    return motion;
  // What fits must do so within the noise of frames that fitted, and clearly better than where the
  // camera was: a crowd that covers the scene fits somewhere, too.
  const double noise =
      std::min(fit.noise, std::min(kMostNoise, noise_ > 0 ? 1 + 1.2 * noise_ : kMostNoise));
  const auto fits_at = [&](const Pose& pose, const GreyLight& light) {
    return marks.step(view(0, grey), pose, light, turns, noise).agree;
  };
  const auto gain_over = [&](const Pose& pose) {
    const double far = largest_way(fit.pose, pose, full.width, full.height);
    if (2 * far < kFar) return std::min(kClearly, kClearly * std::max(0.0, far - kNear));
    return std::min(kFarClearly, kFarClearly * far / kFar);
  };
  const double there = fits_at(fit.pose, fit.light), here = fits_at(rest, look.light),
               then = fits_at(before, fit.light);
  if (std::max({there, here, then}) < kLeastAgree) return motion;
  fit.noise = noise;
  if (!at_rest(fit) && there >= kMovedAgree && there > here + gain_over(rest) &&
      there >= then + gain_over(before)) {
    fit.agree = there;
    return settle(fit, fit.pose);
  }
  fit.agree = std::max(here, then);
  return settle(fit, here >= then ? rest : before);
}

}  // namespace qdmd
