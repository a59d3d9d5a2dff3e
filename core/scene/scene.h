// SPDX-License-Identifier: LGPL-2.1-or-later
// A scene: frames of a street with known background, mask, boxes and light.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "core/scene/description.h"

namespace qdmd::scene {

struct SceneOptions {
  int width = 320, height = 240;  // pixels, 1 .. kMaxSide
  double frames_per_second = 25;  // 0.001 to 1000000
  uint64_t seed = 0;
  std::vector<DrawRecord>* draw_log = nullptr;  // if not null, gets what each stream drew

  static constexpr int kMaxSide = 16384;
};

// Labels of the mask, those of CDnet.
inline constexpr uint8_t kBackgroundLabel = 0;
inline constexpr uint8_t kShadowLabel = 50;
inline constexpr uint8_t kPartLabel = 170;  // an object covers less than half of the pixel
inline constexpr uint8_t kObjectLabel = 255;

// Frame k follows from the options, the effects and k alone, whichever frames came before. Where
// the label is kBackgroundLabel and no effect of the stages air, sensor and link is named, frame
// and true background are equal to the bit. Effects that are not named have no part in it: no
// memory, no random number, no code in the loop over frames.
class Scene {
 public:
  // Throws std::invalid_argument, with a sentence that says what is allowed, for options out of
  // range and for effects that this build or these options cannot serve.
  Scene(const SceneOptions& options, const std::vector<NamedEffect>& effects);
  Scene(const SceneOptions& options, std::string_view text) : Scene(options, parse_scene(text)) {}
  ~Scene();

  int width() const { return state_.width; }
  int height() const { return state_.height; }
  // Frames of the scene; 0: endless.
  int64_t length() const { return plan_.length; }

  // Makes what `wanted` (of Wanted) names of frame `index`, 0 .. 2^40. Valid until the next call.
  void render(int64_t index, unsigned wanted);

  const Picture& frame() const { return state_.picture; }
  // The background as the camera would see it without objects, before weather, noise and codec.
  const Picture& background() const { return state_.truth; }
  // width x height labels.
  const Plane& labels() const { return state_.coverage; }
  // One for every object of which some pixel may be in the frame, without the blur of lens and
  // shutter.
  const std::vector<Box>& boxes() const { return boxes_; }
  // Whose boxes these are: a number that one person or thing has in all frames, and no other.
  const std::vector<uint64_t>& owners() const { return owners_; }
  const Light& light() const { return state_.light; }
  // Pixels by which the camera looks to the right and down of its place, and radians by which it is
  // turned clockwise around the middle of the frame: the frame's pixel (x, y) shows the world at
  // middle + shift + R(turn) ((x, y) - middle), the middle being ((width - 1) / 2, ..).
  double shift_x() const { return state_.shift_x; }
  double shift_y() const { return state_.shift_y; }
  double turn() const { return state_.turn; }

 private:
  struct Stages {
    std::vector<Effect*> world, ground, expose, air, lens, light, meter, sensor, link;
  };

  double metered(double time);
  // Makes it as if every frame arrived.
  void make(int64_t index, unsigned wanted);
  void place(double time);
  void paint_world();
  void paint_objects();
  void crop_to_frame();
  void find_boxes();

  SceneOptions options_;
  std::vector<std::unique_ptr<Effect>> effects_;
  std::unique_ptr<Backdrop> backdrop_;
  Plan plan_;
  Stages stages_;
  bool world_moves_ = false, world_holds_parts_ = false;
  FrameState state_;
  std::vector<Placement> placements_, metered_placements_;
  Picture cropped_, arrived_;
  Plane cropped_plane_;
  std::vector<Box> boxes_;
  std::vector<uint64_t> owners_;
  std::array<double, 3> backdrop_mean_{};
};

}  // namespace qdmd::scene
