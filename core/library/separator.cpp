// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/library/separator.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "core/engine/engine.h"
#include "core/foreground/regions.h"
#include "core/model/learnt_file.h"
#include "core/objects/object_tracker.h"

namespace qdmd::library {
namespace {

static_assert(static_cast<int>(Amplitude::first_frame) ==
              static_cast<int>(qdmd::Amplitude::first_frame));
static_assert(static_cast<int>(Solver::automatic) == static_cast<int>(qdmd::Solver::automatic));
static_assert(static_cast<int>(Estimator::optimized) ==
              static_cast<int>(qdmd::Estimator::optimized));
static_assert(static_cast<int>(Stabilize::similarity) ==
              static_cast<int>(qdmd::Stabilize::similarity));
static_assert(static_cast<int>(Shadows::marked) == static_cast<int>(qdmd::Shadows::marked));
static_assert(static_cast<int>(Output::cutout) == static_cast<int>(qdmd::Output::cutout));

qdmd::Method method_of(Method method) {
  switch (method) {
    case Method::robust:
      return qdmd::Method::robust;
    case Method::qdmd:
      return qdmd::Method::qdmd;
    case Method::dmd:
      return qdmd::Method::dmd;
  }
  throw std::invalid_argument("method is none of robust, qdmd and dmd");
}

// What frames are, besides how they lie in memory.
struct Kind {
  int width = 0, height = 0;
  Colours colours = Colours::rgb;
  int depth = 8;

  bool operator==(const Kind&) const = default;
};

// masks_alone: as far as it is known, nobody is going to ask for another picture.
int mask_scale_of(const Options& options, const Kind& kind, bool masks_alone) {
  if (options.mask_scale != 0) return options.mask_scale;
  return masks_alone ? Reduction::automatic_scale(kind.width, kind.height) : 1;
}

EngineOptions engine_options(const Options& options, const Kind& kind, bool masks_alone = false) {
  EngineOptions result;
  result.mode = options.mode == Mode::live ? qdmd::Mode::live : qdmd::Mode::batch;
  result.method = method_of(options.method);
  result.window_size = options.window_size;
  result.hop_size = options.hop_size;
  result.dmd.rank = options.rank;
  result.dmd.omega_threshold = options.omega_threshold;
  result.dmd.amplitude = static_cast<qdmd::Amplitude>(options.amplitude);
  result.dmd.solver = static_cast<qdmd::Solver>(options.solver);
  result.dmd.estimator = static_cast<qdmd::Estimator>(options.estimator);
  result.sample_step = options.sample_step;
  result.iterations = options.iterations;
  result.stabilize = static_cast<qdmd::Stabilize>(options.stabilize);
  result.stabilize_output = options.stabilize_output;
  result.foreground_threshold = options.foreground_threshold;
  result.shadows = static_cast<qdmd::Shadows>(options.shadows);
  result.mask_softness = options.mask_softness;
  // The engine's own rate would be for frames that come while a window is solved: here none do.
  result.steps = at_rate(result.steps, options.frame_rate);
  result.mask_scale = mask_scale_of(options, kind, masks_alone);
  result.threads = options.threads;
  result.max_memory = options.max_memory;
  result.window_on_disk = options.window_on_disk;
  result.colours = kind.colours;
  result.depth = kind.depth;
  return result;
}

IgnoredAreas areas_of(const std::vector<Rectangle>& rectangles) {
  IgnoredAreas areas;
  for (const Rectangle& area : rectangles)
    if (!areas.add({area.x, area.y, area.width, area.height}))
      throw std::invalid_argument("ignore has rectangles of at least one pixel, and at most " +
                                  std::to_string(IgnoredAreas::kMost));
  return areas;
}

int channels_of(Pixels pixels) {
  switch (pixels) {
    case Pixels::grey:
      return 1;
    case Pixels::rgb:
    case Pixels::bgr:
      return 3;
    case Pixels::rgba:
    case Pixels::bgra:
      return 4;
  }
  throw std::invalid_argument("pixels is none of grey, rgb, bgr, rgba and bgra");
}

void check_rows(ptrdiff_t row_bytes, int64_t needed) {
  if (std::abs(int64_t{row_bytes}) < needed)
    throw std::invalid_argument("row_bytes is " + std::to_string(row_bytes) +
                                " and a row has pixels of " + std::to_string(needed) +
                                " bytes: give the distance from one row to the next");
}

void check_layout(const void* samples, const Layout& layout) {
  if (samples == nullptr) throw std::invalid_argument("a picture's address is null");
  if (layout.width < 1 || layout.height < 1)
    throw std::invalid_argument("a frame needs at least one pixel");
  if (layout.depth < 8 || layout.depth > 16)
    throw std::invalid_argument("depth must be 8 to 16 bits");
  check_rows(layout.row_bytes,
             int64_t{layout.width} * channels_of(layout.pixels) * (layout.depth > 8 ? 2 : 1));
}

template <typename Byte>
BasicImageView<Byte> view_of(Byte* samples, const Layout& layout) {
  const int channels = channels_of(layout.pixels), size = layout.depth > 8 ? 2 : 1;
  const bool blue_first = layout.pixels == Pixels::bgr || layout.pixels == Pixels::bgra;
  BasicImageView<Byte> view;
  for (int c = 0; c < kChannels; ++c)
    view.channel[c] = samples + (channels == 1 ? 0 : size * (blue_first ? kChannels - 1 - c : c));
  if (channels == 4) view.alpha = samples + 3 * size;
  view.bits.depth = layout.depth;
  view.width = layout.width;
  view.height = layout.height;
  view.pixel_stride = channels * size;
  view.row_stride = layout.row_bytes;
  return view;
}

Kind kind_of(const Layout& layout) {
  return {layout.width, layout.height, layout.pixels == Pixels::grey ? Colours::grey : Colours::rgb,
          layout.depth};
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
  using Told = qdmd::ObjectEvent::Kind;
  switch (kind) {
    case Told::appeared:
      return Event::appeared;
    case Told::stopped:
      return Event::stopped;
    case Told::left_behind:
      return Event::left_behind;
    case Told::removed:
      return Event::removed;
    case Told::moved_on:
      return Event::moved_on;
    case Told::gone:
      return Event::gone;
    case Told::motion_begins:
      return Event::motion_begins;
    default:
      return Event::motion_ends;
  }
}

int whole(double length) { return static_cast<int>(std::lround(length)); }

void check(const Status& status) {
  if (!status.ok()) throw std::invalid_argument(status.message);
}

[[noreturn]] void fail(const std::string& what, const std::string& file) {
  throw std::runtime_error("cannot " + what + " " + file + ": " + std::strerror(errno));
}

struct CloseFile {
  void operator()(FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<FILE, CloseFile>;

}  // namespace

struct Separator::State {
  explicit State(const Options& o) : options(o) {
    wishes = first_wishes(engine_options(options, {}));
    wishes.absorb_frames = options.absorb_frames;
    wishes.time_budget = options.time_budget / 1000;
    wishes.ignored = areas_of(options.ignore);
  }

  // Where it refuses, all is as it was.
  void configure(const Kind& wanted, bool masks_alone) {
    if (engine.configured() && wanted == kind) return;
    EngineOptions its = engine_options(options, wanted, masks_alone);
    // What was saved of frames in all their pixels goes on so.
    const bool whole = loaded && loaded->width == wanted.width && loaded->height == wanted.height;
    if (options.mask_scale == 0 && whole) its.mask_scale = 1;
    if (loaded) check_loaded(wanted, its.mask_scale);
    check(engine.configure(its, wanted.width, wanted.height));
    kind = wanted;
    if (loaded) check(engine.learn_from(*loaded));
    end();
  }

  // What was loaded before the first frame belongs to frames like these.
  void check_loaded(const Kind& wanted, int scale) {
    const Reduction its = {wanted.width, wanted.height, scale};
    if (loaded->width == its.small_width() && loaded->height == its.small_height() &&
        loaded->colours == wanted.colours)
      return;
    const std::string size = std::to_string(loaded->width) + "x" + std::to_string(loaded->height);
    loaded.reset();
    throw std::invalid_argument("what was loaded is the background of " + size +
                                " frames, and this frame has another size or other colours: it is "
                                "forgotten");
  }

  LeavingFrame& leaving() {
    LeavingFrame* const frame = engine.next(&wishes);
    if (!frame) throw std::invalid_argument("no frame is ready: push more, or drain()");
    return *frame;
  }

  void push(const void* frame, const Layout& layout, bool masks_alone);
  void write(LeavingFrame* frame, Output output, const Layout& layout, void* picture);

  // Its objects, once a frame.
  void follow(LeavingFrame* frame) {
    if (!options.follow_objects || followed) return;
    const ObjectOptions its = object_options(options);
    const std::vector<qdmd::Region>& regions =
        finder.find(frame->mask(), nullptr, kind.width, kind.height,
                    ObjectTracker::least_area(kind.height, its), true);
    // From a billion frames per second to one a day.
    const double step = std::clamp(1 / options.frame_rate, 1e-9, 86400.0);
    removed.clear();
    const Pose pose = options.stabilize_output ? Pose() : frame->pose();
    UncoveredPlace place;
    while (options.mode == Mode::live && frame->next_uncovered(&place))
      removed.push_back({{place.x - pose.x, place.y - pose.y, static_cast<double>(place.width),
                          static_cast<double>(place.height)},
                         static_cast<double>(place.stood) * step});
    now = std::llround(static_cast<double>(frames) * step * kSecond);
    waiting = tracker.push({regions, removed, now, 0});
    followed = true;
  }

  // Returns its number.
  uint64_t skip(LeavingFrame* frame) {
    frame->skip();
    followed = false;
    return frames++;
  }

  Object object_of(const qdmd::Object& its) const {
    const auto seconds = [this](int64_t since) {
      return since == kNoTime ? 0 : static_cast<double>(now - since) / kSecond;
    };
    return {its.id,
            whole(its.box.x),
            whole(its.box.y),
            whole(its.box.width),
            whole(its.box.height),
            its.area,
            std::hypot(its.vx, its.vy),
            seconds(its.first_time),
            seconds(its.standing_since),
            its.appeared};
  }

  void tell_all(uint64_t number) {
    const std::vector<qdmd::ObjectEvent> events = std::exchange(waiting, {});
    if (!tell) return;
    for (const qdmd::ObjectEvent& event : events) {
      const bool has_object = event.object.id > 0;
      tell({event_of(event.kind), has_object ? object_of(event.object) : Object{}, number,
            event.cut_off});
    }
  }

  // Frames to come are of another time, and may have another size.
  void end() {
    if (!options.follow_objects) return;
    waiting = tracker.end();
    tracker.begin(kind.width, kind.height, object_options(options));
    tell_all(frames);
  }

  Options options;
  Wishes wishes;
  Kind kind;
  // Before the first frame: frames of another depth may come, of which it is told again.
  std::optional<Learnt> loaded;
  std::vector<uint8_t> mask, residual;
  RegionFinder finder;
  ObjectTracker tracker;
  std::vector<RemovedPlace> removed;
  std::vector<qdmd::ObjectEvent> waiting;
  std::function<void(const ObjectEvent&)> tell;
  uint64_t frames = 0;    // that left
  bool followed = false;  // objects of the frame that leaves next
  int64_t now = 0;
  // The last member: its threads end before the rest.
  Engine engine;
};

Separator::Separator(const Options& options) {
  if (options.absorb_frames < 0)
    throw std::invalid_argument("absorb_frames must be 0 (never) or more");
  if (!(options.frame_rate > 0))
    throw std::invalid_argument("frame_rate must be above 0 frames per second");
  if (!(options.time_budget >= 0))
    throw std::invalid_argument("time_budget must be 0 (no limit) or more milliseconds");
  check(EnginePlan(engine_options(options, {}), 1, 1).status());
  state_ = std::make_unique<State>(options);
}
Separator::~Separator() = default;
Separator::Separator(Separator&&) noexcept = default;
Separator& Separator::operator=(Separator&&) noexcept = default;

void Separator::push(const void* frame, const Layout& layout) {
  check_layout(frame, layout);
  state_->push(frame, layout, false);
}

void Separator::State::push(const void* frame, const Layout& layout, bool masks_alone) {
  if (engine.next())
    throw std::invalid_argument("skip() the frames that are ready before you push more");
  configure(kind_of(layout), masks_alone);
  // A frame whose objects were followed was lost.
  if (std::exchange(followed, false)) ++frames;
  check(engine.push(view_of(static_cast<const uint8_t*>(frame), layout), &wishes));
  loaded.reset();
}

bool Separator::ready() const { return state_->engine.next() != nullptr; }

void Separator::State::write(LeavingFrame* frame, Output output, const Layout& layout,
                             void* picture) {
  if (layout.width != kind.width || layout.height != kind.height)
    throw std::invalid_argument("a picture has the size of the frames");
  if (layout.depth != 8 && layout.depth != kind.depth)
    throw std::invalid_argument("a picture has the depth of the frames, or 8 bits");
  if (layout.pixels == Pixels::grey && kind.colours != Colours::grey && output != Output::mask)
    throw std::invalid_argument("of frames with colours only the mask can be grey");
  follow(frame);
  frame->write(static_cast<qdmd::Output>(output), Levels(),
               view_of(static_cast<uint8_t*>(picture), layout));
}

void Separator::write(Output output, const Layout& layout, void* picture) {
  check_layout(picture, layout);
  state_->write(&state_->leaving(), output, layout, picture);
  state_->tell_all(state_->frames);
}

std::vector<Region> Separator::regions(int least_area) {
  if (least_area < 0) throw std::invalid_argument("least_area must be 0 (chosen) or more pixels");
  State& its = *state_;
  LeavingFrame& leaving = its.leaving();
  const auto pixels = static_cast<size_t>(its.kind.width) * static_cast<size_t>(its.kind.height);
  its.mask.resize(pixels);
  its.residual.resize(pixels);
  leaving.foreground(its.mask.data(), its.residual.data());
  std::vector<Region> regions;
  for (const qdmd::Region& found : its.finder.find(its.mask.data(), its.residual.data(),
                                                   its.kind.width, its.kind.height, least_area))
    regions.push_back(
        {found.x, found.y, found.width, found.height, found.area, found.mean_residual});
  return regions;
}

void Separator::skip() {
  LeavingFrame& leaving = state_->leaving();
  state_->follow(&leaving);
  state_->tell_all(state_->skip(&leaving));
}

void Separator::drain() {
  if (state_->engine.configured()) check(state_->engine.drain());
}

void Separator::apply(const void* frame, const Layout& layout, uint8_t* mask,
                      ptrdiff_t mask_row_bytes) {
  if (state_->options.mode != Mode::live)
    throw std::invalid_argument(
        "apply() gives a mask at once, which mode=batch cannot: push() frames, and take pictures "
        "when ready() says that there are some");
  Layout of_mask = layout;
  of_mask.row_bytes = mask_row_bytes;
  of_mask.pixels = Pixels::grey;
  of_mask.depth = 8;
  check_layout(mask, of_mask);
  check_layout(frame, layout);
  state_->push(frame, layout, true);
  LeavingFrame& leaving = state_->leaving();
  state_->write(&leaving, Output::mask, of_mask, mask);
  // Who is told may throw: the frame has left by then.
  state_->tell_all(state_->skip(&leaving));
}

bool Separator::background(const Layout& layout, void* picture) {
  check_layout(picture, layout);
  const Kind& kind = state_->kind;
  if (layout.width != kind.width || layout.height != kind.height) return false;
  if (layout.depth != 8 && layout.depth != kind.depth)
    throw std::invalid_argument("a picture has the depth of the frames, or 8 bits");
  if (layout.pixels == Pixels::grey && kind.colours != Colours::grey)
    throw std::invalid_argument("the background of frames with colours has colours");
  return state_->engine.write_background(view_of(static_cast<uint8_t*>(picture), layout));
}

Layout Separator::frames() const {
  const Kind& kind = state_->kind;
  return {kind.width, kind.height, 0, kind.colours == Colours::grey ? Pixels::grey : Pixels::rgb,
          kind.depth};
}

void Separator::freeze(bool freeze) { state_->wishes.freeze = freeze; }

void Separator::ignore(const std::vector<Rectangle>& areas) {
  state_->wishes.ignored = areas_of(areas);
}

void Separator::reset() {
  state_->loaded.reset();
  // flush() would keep when solves are due.
  state_->engine.close();
  state_->kind = {};
  state_->end();
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

std::vector<uint8_t> Separator::save() {
  Learnt learnt;
  if (!state_->engine.learnt(&learnt)) return {};
  learnt.colours = state_->kind.colours;
  return pack(learnt);
}

void Separator::load(const uint8_t* bytes, size_t size) {
  Learnt learnt;
  if (const Status status = unpack({bytes, size}, &learnt); !status.ok())
    throw std::invalid_argument("what was saved cannot be loaded: " + status.message);
  State& its = *state_;
  if (its.engine.configured() && !its.loaded) {
    check(its.engine.plan().may_learn_from(learnt));
    if (learnt.colours != its.kind.colours)
      throw std::invalid_argument("it is the background of frames of other colours");
    check(its.engine.learn_from(learnt));
    return;
  }
  // Its background can be had before the first frame, in the size that it was learnt in, enlarged
  // as frames ask for it.
  const int scale = std::max(1, its.options.mask_scale);
  const Kind kind = {scale * learnt.width, scale * learnt.height, learnt.colours,
                     learnt.picture.depth};
  if (kind.colours == Colours::yuv)
    throw std::invalid_argument(
        "it is the background of YUV video: save that of video in RGB or grey");
  check(its.engine.configure(engine_options(its.options, kind), kind.width, kind.height));
  its.kind = kind;
  its.loaded = std::move(learnt);
  check(its.engine.learn_from(*its.loaded));
  its.end();
}

void Separator::save(const std::string& file) {
  const std::vector<uint8_t> bytes = save();
  if (bytes.empty())
    throw std::invalid_argument("nothing is learnt yet: save after the first frames");
  // What the file held is lost only when all is written.
  const std::string part = file + ".part";
  File out(std::fopen(part.c_str(), "wb"));
  if (!out) fail("write", part);
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), out.get()) == bytes.size() &&
                       std::fflush(out.get()) == 0;
  if (!written) {
    const int why = errno;
    out.reset();
    std::remove(part.c_str());
    errno = why;
    fail("write", file);
  }
  out.reset();
  if (std::rename(part.c_str(), file.c_str()) != 0) {
    const int why = errno;
    std::remove(part.c_str());
    errno = why;
    fail("write", file);
  }
}

void Separator::load(const std::string& file) {
  if (std::error_code error; !std::filesystem::is_regular_file(file, error))
    throw std::runtime_error("cannot read " + file + ": it is not a regular file");
  const File in(std::fopen(file.c_str(), "rb"));
  if (!in) fail("read", file);
  const auto all = static_cast<uint64_t>(std::filesystem::file_size(file));
  std::vector<uint8_t> bytes(std::min<uint64_t>(all, kLearntHeaderBytes));
  // Nothing of its size is taken before that is known to be right.
  const auto fill = [&](size_t from) {
    const size_t count = bytes.size() - from;
    if (std::fread(bytes.data() + from, 1, count, in.get()) != count) fail("read", file);
  };
  fill(0);
  if (const Status status = check_header(bytes, all); !status.ok())
    throw std::invalid_argument("cannot load " + file + ": " + status.message);
  const size_t header = bytes.size();
  bytes.resize(all);
  fill(header);
  load(bytes.data(), bytes.size());
}

}  // namespace qdmd::library
