// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"
#include "core/scene/effects/times.h"

namespace qdmd::scene {
namespace {

constexpr int kSide = 16;      // pixels of a block
constexpr double kReach = 96;  // pixels by which a block that is concealed is moved at most

class LostBlocks : public Effect {
 public:
  LostBlocks(Values values, const StreamSource& streams)
      : share_(values[0]), length_(values[1]), times_(values.last(3)), streams_(streams) {}

  void sensor(FrameState& state) override {
    if (share_ == 0 || !times_.on(state.time)) return;
    Picture& picture = state.picture;
    received_.samples = picture.samples;
    received_.width = picture.width, received_.height = picture.height;
    Stream stream = streams_.at(state.index);
    // A packet holds blocks side by side, and the next one begins where it ends.
    const int columns = (picture.width + kSide - 1) / kSide;
    const int blocks = columns * ((picture.height + kSide - 1) / kSide);
    const auto length = static_cast<int>(length_);
    for (int first = 0; first < blocks; first += length) {
      if (stream.uniform() >= share_) continue;
      const auto right = static_cast<int>(stream.uniform(-kReach, kReach));
      const auto down = static_cast<int>(stream.uniform(-kReach, kReach));
      for (int block = first; block < std::min(first + length, blocks); ++block)
        conceal(block % columns * kSide, block / columns * kSide, right, down, &picture);
    }
  }

 private:
  // Decoders show another place of the picture where a block is missing.
  void conceal(int left, int top, int right, int down, Picture* picture) const {
    for (int y = top; y < std::min(top + kSide, picture->height); ++y)
      for (int x = left; x < std::min(left + kSide, picture->width); ++x)
        std::copy_n(received_.at(std::clamp(x + right, 0, picture->width - 1),
                                 std::clamp(y + down, 0, picture->height - 1)),
                    3, picture->at(x, y));
  }

  double share_, length_;
  Times times_;
  StreamSource streams_;
  Picture received_;
};

constexpr Parameter kParameters[] = {
    {"share", "of the packets", 0.2, 0, 1, "how many are lost"},
    {"length", "blocks", 10, 1, 1000, "blocks of 16 x 16 pixels in a packet", true},
    Times::kFrom,
    Times::kSeconds,
    Times::kEvery,
};

}  // namespace

const EffectInfo kLostBlocks = {
    "lost-blocks",
    "disturbance: packets are lost, and their blocks show other places of the picture; the truth "
    "goes on",
    kSensor,
    kRandom | kBuffers,
    kParameters,
    make_effect<LostBlocks>};

}  // namespace qdmd::scene
