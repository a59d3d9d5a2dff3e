// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/scene.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/scene/paint.h"

namespace qdmd::scene {
namespace {

void check(const SceneOptions& options) {
  const int longest = SceneOptions::kMaxSide;
  if (options.width < 1 || options.height < 1 || options.width > longest ||
      options.height > longest)
    throw std::invalid_argument("A scene has sides of 1 to " + std::to_string(longest) +
                                " pixels: change width and height.");
  if (!(options.frames_per_second >= 1e-3 && options.frames_per_second <= 1e6))
    throw std::invalid_argument(
        "A scene needs 0.001 to 1000000 frames/s: change frames_per_second, which is the framerate "
        "of the caps.");
}

struct Corners {
  double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
};

// The corners in the frame of a box of the world, before it is cut off.
Corners seen_corners(const Box& box, const FrameState& state) {
  const double middle_x = (state.width - 1) / 2.0, middle_y = (state.height - 1) / 2.0;
  const double cosine = std::cos(state.turn), sine = std::sin(state.turn);
  Corners seen;
  for (const double x : {double(box.x), double(box.right())})
    for (const double y : {double(box.y), double(box.bottom())}) {
      const double u = x - state.shift_x - middle_x, v = y - state.shift_y - middle_y;
      const double at_x = state.turn == 0 ? x - state.shift_x : middle_x + cosine * u + sine * v;
      const double at_y = state.turn == 0 ? y - state.shift_y : middle_y - sine * u + cosine * v;
      seen = {std::min(seen.left, at_x), std::min(seen.top, at_y), std::max(seen.right, at_x),
              std::max(seen.bottom, at_y)};
    }
  return seen;
}

}  // namespace

Scene::Scene(const SceneOptions& options, const std::vector<NamedEffect>& named)
    : options_(options) {
  check(options);
  const auto streams = [&](std::string_view name) {
    return StreamSource(options.seed, name, options.draw_log);
  };
  int margin = 0;
  for (const NamedEffect& effect : named) {
    effects_.push_back(effect.info->make(effect.values, streams(effect.info->name)));
    margin += effects_.back()->margin(options.width, options.height);
  }
  backdrop_ =
      std::make_unique<Backdrop>(options.width, options.height, margin, streams("backdrop"));

  plan_.width = options.width;
  plan_.height = options.height;
  plan_.interval = 1 / options.frames_per_second;
  plan_.backdrop = backdrop_.get();
  plan_.metered = [this](double time) { return metered(time); };
  for (size_t i = 0; i < named.size(); ++i) {
    Effect* effect = effects_[i].get();
    const unsigned stages = named[i].info->stages;
    effect->plan(plan_);
    if (stages & kWorld) stages_.world.push_back(effect);
    if (stages & kGround) stages_.ground.push_back(effect);
    if (stages & kExpose) stages_.expose.push_back(effect);
    if (stages & kAir) stages_.air.push_back(effect);
    if (stages & kLens) stages_.lens.push_back(effect);
    if (stages & kLight) stages_.light.push_back(effect);
    if (stages & kMeter) stages_.meter.push_back(effect);
    if (stages & kSensor) stages_.sensor.push_back(effect);
    if (stages & kLink) stages_.link.push_back(effect);
  }
  // It draws its numbers in any case: an effect changes no other's.
  auto mover = std::make_unique<Crossing>(options.width, options.height, plan_.pause,
                                          streams("mover"), plan_.dress);
  if (plan_.crossed) plan_.actors.push_back(std::move(mover));

  state_.width = options.width;
  state_.height = options.height;
  state_.margin = margin;
  state_.interval = plan_.interval;
  state_.world = backdrop_->picture();
  if (!stages_.meter.empty()) backdrop_mean_ = backdrop_->mean({});
}

Scene::~Scene() = default;

// The light that falls on the street and on people in view; where it falls on a part of the
// frame, levels are taken for those of all of it.
double Scene::metered(double time) {
  Light light;
  for (const Effect* effect : stages_.light) effect->light(time, &light);
  std::array<double, 3> mean = backdrop_mean_;
  metered_placements_.clear();
  for (const auto& actor : plan_.actors) actor->place(time, &metered_placements_);
  const Box frame{0, 0, options_.width, options_.height};
  for (const Placement& placement : metered_placements_) {
    const Box seen = intersection(placement.box(), frame), whole = placement.box();
    if (seen.empty()) continue;
    const double visible = static_cast<double>(seen.width) * seen.height / whole.width /
                           whole.height * placement.sprite->area;
    const double share = std::min(1.0, visible / frame.width / frame.height);
    for (size_t c = 0; c < 3; ++c)
      mean[c] += share * (placement.sprite->mean[c] - backdrop_mean_[c]);
  }
  double level = 0;
  for (size_t c = 0; c < 3; ++c) level += light.gain[c] * mean[c] / 3;
  return light.local.empty() ? level : level * mean_local_light(light, frame.width, frame.height);
}

// Whoever is there, the farthest first.
void Scene::place(double time) {
  placements_.clear();
  for (size_t actor = 0; actor < plan_.actors.size(); ++actor) {
    size_t next = placements_.size();
    plan_.actors[actor]->place(time, &placements_);
    // Numbers of one actor are below 2^40 in size.
    for (; next < placements_.size(); ++next)
      placements_[next].who += static_cast<int64_t>(actor) << 42;
  }
  for (size_t i = 1; i < placements_.size(); ++i)
    for (size_t k = i; k > 0 && placements_[k].feet() < placements_[k - 1].feet(); --k)
      std::swap(placements_[k], placements_[k - 1]);
}

void Scene::paint_world() {
  const bool any_part = std::any_of(placements_.begin(), placements_.end(),
                                    [](const Placement& p) { return p.part_of_background; });
  const bool moves = any_part || !stages_.world.empty();
  world_holds_parts_ = any_part;
  // A world that stands still was painted when the scene was made.
  if (moves || world_moves_) state_.world = backdrop_->picture();
  world_moves_ = moves;
  if (!moves) return;
  for (Effect* effect : stages_.world) effect->world(state_);
  for (const Placement& placement : placements_)
    if (placement.part_of_background)
      paint_sprite(*placement.sprite, placement.x + state_.margin, placement.y + state_.margin,
                   &state_.world);
  paint_sprite(state_.front, 0, 0, &state_.world);
}

void Scene::paint_objects() {
  const bool labels = state_.wants(kLabels), frame = state_.wants(kFrame);
  if (frame) state_.picture = state_.world;
  if (labels) {
    state_.coverage.resize(state_.world.width, state_.world.height);
    state_.coverage.fill(0);
  }
  if (!stages_.ground.empty()) {
    state_.shadow.resize(state_.world.width, state_.world.height);
    state_.shadow.fill(0);
  }
  for (Effect* effect : stages_.ground) effect->ground(state_, placements_);
  for (const Placement& placement : placements_) {
    if (placement.part_of_background) continue;
    const int x = placement.x + state_.margin, y = placement.y + state_.margin;
    if (frame) paint_sprite(*placement.sprite, x, y, &state_.picture);
    if (labels) paint_coverage(*placement.sprite, x, y, 255, &state_.coverage);
  }
  if (frame) paint_sprite(state_.front, 0, 0, &state_.picture);
  if (labels) paint_coverage(state_.front, 0, 0, 0, &state_.coverage);
  if (labels && !stages_.ground.empty()) paint_coverage(state_.front, 0, 0, 0, &state_.shadow);
}

void Scene::find_boxes() {
  boxes_.clear();
  owners_.clear();
  for (const Placement& placement : placements_) {
    if (placement.part_of_background) continue;
    const Corners whole = seen_corners(placement.box(), state_);
    const int left = static_cast<int>(std::floor(whole.left));
    const int top = static_cast<int>(std::floor(whole.top));
    const int right = static_cast<int>(std::ceil(whole.right));
    const int bottom = static_cast<int>(std::ceil(whole.bottom));
    const Box seen =
        intersection({left, top, right - left, bottom - top}, {0, 0, state_.width, state_.height});
    if (seen.empty()) continue;
    boxes_.push_back(seen);
    owners_.push_back(static_cast<uint64_t>(placement.who));
  }
}

void Scene::crop_to_frame() {
  const double left = state_.margin + state_.shift_x, top = state_.margin + state_.shift_y;
  const auto cut = [&](auto* canvas, auto* frame) {
    frame->resize(state_.width, state_.height);
    if (state_.turn != 0)
      crop_turned(*canvas, left, top, state_.turn, frame);
    else
      crop(*canvas, left, top, frame);
    std::swap(*canvas, *frame);
  };
  if (state_.wants(kFrame)) cut(&state_.picture, &cropped_);
  if (state_.wants(kTruth)) cut(&state_.truth, &cropped_);
  if (state_.wants(kLabels)) {
    cut(&state_.coverage, &cropped_plane_);
    if (!state_.shadow.samples.empty()) cut(&state_.shadow, &cropped_plane_);
  }
}

void Scene::render(int64_t index, unsigned wanted) {
  int64_t arrives = index;
  for (const Effect* effect : stages_.link) arrives = effect->arrives(arrives);
  if (arrives == index || (wanted & kFrame) == 0) return make(index, wanted);
  // The picture is that of another frame; all that is true of the scene goes on.
  make(arrives, kFrame);
  std::swap(state_.picture, arrived_);
  make(index, wanted & ~static_cast<unsigned>(kFrame));
  std::swap(state_.picture, arrived_);
}

void Scene::make(int64_t index, unsigned wanted) {
  state_.index = index;
  state_.wanted = wanted;
  state_.time = static_cast<double>(index) * (plan_.pace > 0 ? plan_.pace : plan_.interval);
  state_.shift_x = state_.shift_y = state_.turn = 0;

  place(state_.time);
  paint_world();
  if (state_.wants(kFrame) || state_.wants(kLabels)) {
    if (stages_.expose.empty()) paint_objects();
    for (Effect* effect : stages_.expose)
      effect->expose(state_, [this](double time) {
        place(time);
        // The world is that of the frame's time: who has left it by then is an object before, too.
        if (!world_holds_parts_)
          for (Placement& placement : placements_) placement.part_of_background = false;
        paint_objects();
      });
  }
  if (state_.wants(kTruth)) state_.truth = state_.world;
  if (state_.wants(kFrame))
    for (Effect* effect : stages_.air) effect->air(state_);

  for (Effect* effect : stages_.lens) effect->lens(state_);
  if (state_.margin > 0) crop_to_frame();

  state_.light.reset();
  for (const Effect* effect : stages_.light) effect->light(state_.time, &state_.light);
  for (LocalLight& part : state_.light.local) part.x -= state_.shift_x, part.y -= state_.shift_y;
  for (const Effect* effect : stages_.meter) effect->meter(state_.time, &state_.light);
  if (!stages_.light.empty() || !stages_.meter.empty()) {
    if (state_.wants(kFrame)) apply(state_.light, &state_.picture);
    if (state_.wants(kTruth)) apply(state_.light, &state_.truth);
  }

  if (state_.wants(kFrame))
    for (Effect* effect : stages_.sensor) effect->sensor(state_);
  if (state_.wants(kLabels)) to_labels(state_.shadow, &state_.coverage);
  if (state_.wants(kBoxes)) {
    if (!stages_.expose.empty()) place(state_.time);
    find_boxes();
  }
}

}  // namespace qdmd::scene
