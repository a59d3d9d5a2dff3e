#include "core/library/separator.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/engine/engine.h"
#include "core/foreground/regions.h"
#include "core/objects/object_tracker.h"

namespace qdmd::library {
namespace {

EngineOptions engine_options(const Options& options) {
  EngineOptions result;
  switch (options.method) {
    case Method::robust:
      result.method = qdmd::Method::robust;
      break;
    case Method::qdmd:
      result.method = qdmd::Method::qdmd;
      break;
    case Method::dmd:
      result.method = qdmd::Method::dmd;
      break;
  }
  result.mode = Mode::live;
  result.window_size = options.window_size;
  result.hop_size = options.hop_size;
  result.stabilize = options.stabilize ? Stabilize::translation : Stabilize::off;
  result.foreground_threshold = options.foreground_threshold;
  result.threads = options.threads;
  result.max_memory = options.max_memory;
  return result;
}

template <typename Byte>
BasicImageView<Byte> view_of(Byte* samples, const Layout& layout) {
  BasicImageView<Byte> view;
  for (int c = 0; c < kChannels; ++c)
    view.channel[c] = samples + (layout.blue_first ? kChannels - 1 - c : c);
  view.width = layout.width;
  view.height = layout.height;
  view.pixel_stride = kChannels;
  view.row_stride = layout.row_bytes;
  return view;
}

ObjectOptions object_options(const Options& options) {
  ObjectOptions result;
  result.min_size = options.object_min_size;
  result.appear_seconds = options.appear_seconds;
  result.stop_seconds = options.stop_seconds;
  result.gone_seconds = options.gone_seconds;
  result.grace_seconds = options.motion_end_seconds;
  return result;
}

Event event_of(qdmd::ObjectEvent::Kind kind) {
  using Kind = qdmd::ObjectEvent::Kind;
  switch (kind) {
    case Kind::appeared:
      return Event::appeared;
    case Kind::stopped:
      return Event::stopped;
    case Kind::left_behind:
      return Event::left_behind;
    case Kind::removed:
      return Event::removed;
    case Kind::moved_on:
      return Event::moved_on;
    case Kind::gone:
      return Event::gone;
    case Kind::motion_begins:
      return Event::motion_begins;
    default:
      return Event::motion_ends;
  }
}

int pixels(double length) { return static_cast<int>(std::lround(length)); }

void check(const Status& status) {
  if (!status.ok()) throw std::invalid_argument(status.message);
}

}  // namespace

struct Separator::State {
  explicit State(const Options& o) : options(o) {
    wishes = first_wishes(engine_options(options));
    wishes.absorb_frames = options.absorb_frames;
  }

  void configure(int w, int h) {
    if (engine.configured() && w == width && h == height) return;
    end();
    engine.close();
    width = height = 0;
    check(engine.configure(engine_options(options), w, h));
    width = w, height = h;
    tracker.begin(w, h, object_options(options));
  }

  // The frame that leaves, without pictures yet.
  void follow(LeavingFrame* frame) {
    if (!options.follow_objects) return;
    const ObjectOptions its = object_options(options);
    const std::vector<Region>& regions = finder.find(frame->mask(), nullptr, width, height,
                                                     ObjectTracker::least_area(height, its), true);
    removed.clear();
    UncoveredPlace place;
    const Pose pose = frame->pose();
    while (frame->next_uncovered(&place))
      removed.push_back({{place.x - pose.x, place.y - pose.y, static_cast<double>(place.width),
                          static_cast<double>(place.height)},
                         static_cast<double>(place.stood) / options.frames_per_second});
    now = std::llround(static_cast<double>(frames) * kSecond / options.frames_per_second);
    waiting = tracker.push({regions, removed, now, 0});
  }

  Object object_of(const qdmd::Object& its) const {
    const auto seconds = [this](int64_t since) {
      return since == kNoTime ? 0 : static_cast<double>(now - since) / kSecond;
    };
    return {its.id,
            pixels(its.box.x),
            pixels(its.box.y),
            pixels(its.box.width),
            pixels(its.box.height),
            its.area,
            std::hypot(its.vx, its.vy),
            seconds(its.first_time),
            seconds(its.standing_since),
            its.appeared};
  }

  void tell_all() {
    const std::vector<qdmd::ObjectEvent> events = std::exchange(waiting, {});
    if (!tell) return;
    for (const qdmd::ObjectEvent& event : events) {
      const bool has_object = event.object.id > 0;
      tell({event_of(event.kind), has_object ? object_of(event.object) : Object{}, frames,
            event.cut_off});
    }
  }

  void end() {
    if (!options.follow_objects || width == 0) return;
    waiting = tracker.end();
    tell_all();
  }

  Options options;
  Wishes wishes;
  Engine engine;
  int width = 0, height = 0;
  RegionFinder finder;
  ObjectTracker tracker;
  std::vector<RemovedPlace> removed;
  std::vector<qdmd::ObjectEvent> waiting;
  std::function<void(const ObjectEvent&)> tell;
  uint64_t frames = 0;
  int64_t now = 0;
};

Separator::Separator(const Options& options) : state_(std::make_unique<State>(options)) {
  if (options.absorb_frames < 0)
    throw std::invalid_argument("absorb_frames must be 0 (never) or more");
  if (!(options.frames_per_second > 0))
    throw std::invalid_argument("frames_per_second must be above 0");
  check(EnginePlan(engine_options(options), 1, 1).status());
}
Separator::~Separator() = default;
Separator::Separator(Separator&&) noexcept = default;
Separator& Separator::operator=(Separator&&) noexcept = default;

void Separator::apply(const uint8_t* frame, const Layout& layout, uint8_t* mask,
                      ptrdiff_t mask_row_bytes) {
  state_->configure(layout.width, layout.height);
  Engine& engine = state_->engine;
  check(engine.push(view_of(frame, layout), &state_->wishes));
  // One plane stands for all three channels.
  MutableImageView out;
  for (uint8_t*& channel : out.channel) channel = mask;
  out.width = layout.width;
  out.height = layout.height;
  out.pixel_stride = 1;
  out.row_stride = mask_row_bytes;
  LeavingFrame* const leaving = engine.next();
  state_->follow(leaving);
  leaving->pop(Output::mask, out);
  state_->tell_all();
  ++state_->frames;
}

std::vector<Object> Separator::objects() const {
  std::vector<Object> all;
  if (state_->options.follow_objects)
    for (const qdmd::Object& object : state_->tracker.objects())
      all.push_back(state_->object_of(object));
  return all;
}

void Separator::on_event(std::function<void(const ObjectEvent&)> tell) {
  state_->tell = std::move(tell);
}

void Separator::end() { state_->end(); }

bool Separator::background(const Layout& layout, uint8_t* picture) {
  if (layout.width != state_->width || layout.height != state_->height) return false;
  return state_->engine.write_background(view_of(picture, layout));
}

void Separator::freeze(bool freeze) { state_->wishes.freeze = freeze; }

}  // namespace qdmd::library
