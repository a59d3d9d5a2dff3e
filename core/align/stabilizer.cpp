#include "core/align/stabilizer.h"

#include <algorithm>
#include <cmath>

namespace qdmd {
namespace {

// First frames whose mean is the reference until there is a background.
constexpr int kFirstFrames = 16;
// Of the picture's longer side: further beside is another view.
constexpr double kFarthest = 1.0 / 8;
// Frames in a row that are beyond that, and that show nothing that is known.
constexpr int kBeyond = 8, kLost = 100;

}  // namespace

Stabilizer::Stabilizer(Stabilize how, Colours colours, int width, int height)
    : turns_(how == Stabilize::similarity),
      // Green is most of what is seen.
      channel_(colours == Colours::rgb ? 1 : 0),
      width_(width),
      height_(height),
      finder_(width, height),
      sum_(static_cast<size_t>(width) * static_cast<size_t>(height)),
      mean_(sum_.size()) {}

uint64_t Stabilizer::bytes(int width, int height) {
  const uint64_t pixels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
  return MotionFinder::bytes(width, height) + pixels * (sizeof(uint16_t) + 1);
}

void Stabilizer::forget() {
  finder_.forget();
  anew_ = true;
  pose_ = {};
  lost_ = beyond_ = summed_ = 0;
}

void Stabilizer::begin(const uint8_t* grey, const IgnoredAreas& ignored) {
  finder_.forget();
  finder_.take_reference(grey, ignored);
  std::fill(sum_.begin(), sum_.end(), uint16_t{0});
  summed_ = lost_ = beyond_ = 0;
  since_reference_ = 0;
  pose_ = {};
  anew_ = false;
}

Pose Stabilizer::follow(const uint8_t* grey, const IgnoredAreas& ignored) {
  ++since_reference_;
  if (anew_ || !finder_.known()) {
    begin(grey, ignored);
    return pose_;
  }
  const Motion motion = finder_.find(grey, pose_, turns_);
  const double farthest = kFarthest * std::max(width_, height_);
  const bool beyond = motion.found && std::hypot(motion.pose.x, motion.pose.y) > farthest;
  if (motion.found && !beyond) {
    lost_ = beyond_ = 0;
    pose_ = motion.pose;
    return pose_;
  }
  ++lost_;
  beyond_ = beyond ? beyond_ + 1 : 0;
  if (beyond_ < kBeyond && lost_ < kLost) return pose_;
  if (beyond) ++views_;
  begin(grey, ignored);
  return pose_;
}

void Stabilizer::saw(const uint8_t* grey, const IgnoredAreas& ignored) {
  if (summed_ >= kFirstFrames || lost_ > 0) return;
  ++summed_;
  for (size_t i = 0; i < sum_.size(); ++i) sum_[i] = static_cast<uint16_t>(sum_[i] + grey[i]);
  if (summed_ != kFirstFrames) return;
  for (size_t i = 0; i < sum_.size(); ++i)
    mean_[i] = static_cast<uint8_t>((sum_[i] + kFirstFrames / 2) / kFirstFrames);
  finder_.take_reference(mean_.data(), ignored);
}

void Stabilizer::refer_to(const uint8_t* grey, const IgnoredAreas& ignored) {
  finder_.take_reference(grey, ignored);
  summed_ = kFirstFrames;
  since_reference_ = 0;
  anew_ = false;
}

}  // namespace qdmd
