// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/object_scenes.h"

#include <istream>
#include <ostream>
#include <stdexcept>

#include "core/engine/engine.h"
#include "core/scene/scene.h"

namespace qdmd::evaluation {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kRate = 25;

ImageView view_of(const scene::Picture& picture) {
  ImageView view;
  for (int c = 0; c < 3; ++c) view.channel[c] = picture.samples.data() + c;
  view.width = picture.width;
  view.height = picture.height;
  view.pixel_stride = 3;
  view.row_stride = 3 * picture.width;
  return view;
}

std::vector<Region> regions_of(const uint8_t* mask, RegionFinder* finder) {
  return finder->find(mask, nullptr, kWidth, kHeight, ObjectTracker::least_area(kHeight, {}), true);
}

std::vector<Region> true_regions(const scene::Plane& labels, RegionFinder* finder) {
  std::vector<uint8_t> mask(labels.samples.begin(), labels.samples.end());
  for (uint8_t& sample : mask) sample = sample == scene::kObjectLabel ? 255 : 0;
  return regions_of(mask.data(), finder);
}

void require(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.message);
}

}  // namespace

ObservedScene observe(const std::string& name, uint64_t seed, int frames, MasksOf masks) {
  const bool live = masks == MasksOf::live, truth = masks == MasksOf::truth;
  ObservedScene result = {name, seed, kWidth, kHeight, kRate, {}};
  scene::Scene scene({kWidth, kHeight, kRate, seed, nullptr}, name);
  Engine engine;
  EngineOptions options;
  options.method = Method::robust;
  options.mode = live ? Mode::live : Mode::batch;
  options.stabilize = Stabilize::translation;
  options.frame_rate = kRate;
  require(engine.configure(options, kWidth, kHeight));
  RegionFinder finder;
  size_t next = 0;
  const auto take = [&] {
    while (LeavingFrame* leaving = engine.next()) {
      ObservedFrame& frame = result.frames[next++];
      const auto begin = std::chrono::steady_clock::now();
      const uint8_t* const mask = leaving->mask();
      result.mask_seconds += seconds_since(begin);
      const auto middle = std::chrono::steady_clock::now();
      frame.regions = regions_of(mask, &finder);
      result.region_seconds += seconds_since(middle);
      UncoveredPlace place;
      while (live && leaving->next_uncovered(&place))
        frame.removed.push_back(
            {{double(place.x), double(place.y), double(place.width), double(place.height)},
             static_cast<double>(place.stood) / kRate});
      leaving->skip();
    }
  };
  for (int k = 0; k < frames; ++k) {
    scene.render(k, scene::kFrame | scene::kBoxes | (truth ? scene::kLabels : 0u));
    ObservedFrame& frame = result.frames.emplace_back();
    for (size_t i = 0; i < scene.boxes().size(); ++i) {
      const scene::Box& box = scene.boxes()[i];
      frame.truth.push_back(
          {static_cast<int64_t>(scene.owners()[i]),
           {double(box.x), double(box.y), double(box.width), double(box.height)}});
    }
    if (truth) {
      frame.regions = true_regions(scene.labels(), &finder);
      continue;
    }
    const auto begin = std::chrono::steady_clock::now();
    require(engine.push(view_of(scene.frame())));
    result.mask_seconds += seconds_since(begin);
    take();
  }
  require(engine.drain());
  take();
  return result;
}

void write(const ObservedScene& scene, std::ostream* out) {
  *out << scene.scene << ' ' << scene.seed << ' ' << scene.width << ' ' << scene.height << ' '
       << scene.rate << ' ' << scene.frames.size() << '\n';
  for (const ObservedFrame& frame : scene.frames) {
    *out << frame.regions.size() << ' ' << frame.removed.size() << ' ' << frame.truth.size();
    for (const Region& r : frame.regions)
      *out << ' ' << r.x << ' ' << r.y << ' ' << r.width << ' ' << r.height << ' ' << r.area;
    const auto put = [&](const ObjectBox& b) {
      *out << ' ' << b.x << ' ' << b.y << ' ' << b.width << ' ' << b.height;
    };
    for (const RemovedPlace& r : frame.removed) put(r.box), *out << ' ' << r.stood_seconds;
    for (const NumberedBox& t : frame.truth) put(t.box), *out << ' ' << t.id;
    *out << '\n';
  }
}

bool read(std::istream* in, ObservedScene* scene) {
  size_t frames = 0;
  if (!(*in >> scene->scene >> scene->seed >> scene->width >> scene->height >> scene->rate >>
        frames))
    return false;
  scene->frames.assign(frames, {});
  for (ObservedFrame& frame : scene->frames) {
    size_t regions = 0, removed = 0, truth = 0;
    *in >> regions >> removed >> truth;
    frame.regions.resize(regions), frame.removed.resize(removed), frame.truth.resize(truth);
    for (Region& r : frame.regions) *in >> r.x >> r.y >> r.width >> r.height >> r.area;
    const auto get = [&](ObjectBox& b) { *in >> b.x >> b.y >> b.width >> b.height; };
    for (RemovedPlace& r : frame.removed) get(r.box), *in >> r.stood_seconds;
    for (NumberedBox& t : frame.truth) get(t.box), *in >> t.id;
  }
  return static_cast<bool>(*in);
}

}  // namespace qdmd::evaluation
