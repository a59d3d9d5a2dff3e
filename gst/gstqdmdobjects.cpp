// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/gstqdmdobjects.h"

#include <algorithm>
#include <cmath>
#include <new>

#ifdef QDMD_HAVE_ANALYTICS
#include "gst/analytics.h"
#endif
#include "gst/videoview.h"

namespace qdmd {
namespace {

// What nobody knows the rate of comes as often as that.
constexpr gint64 kAssumedStep = GST_SECOND / 25;

gint64 step_of(const GstVideoInfo& info) {
  const auto n = guint64(GST_VIDEO_INFO_FPS_N(&info)), d = guint64(GST_VIDEO_INFO_FPS_D(&info));
  return n > 0 && d > 0 ? gint64(gst_util_uint64_scale(GST_SECOND, d, n)) : kAssumedStep;
}

bool is_of_picture(const ObjectEvent& event) {
  return event.kind == ObjectEvent::Kind::motion_begins ||
         event.kind == ObjectEvent::Kind::motion_ends;
}

// Whole pixels.
struct Pixels {
  explicit Pixels(const ObjectBox& box)
      : x(guint(std::lround(box.x))),
        y(guint(std::lround(box.y))),
        width(guint(std::lround(std::max(1.0, box.width)))),
        height(guint(std::lround(std::max(1.0, box.height)))) {}
  guint x, y, width, height;
};

double share_of(const Object& object) { return object.area / std::max(1.0, object.box.area()); }
double speed_of(const Object& object) { return std::hypot(object.vx, object.vy); }

// What the tracker was told: no time of a stream is before 0.
guint64 told(gint64 time) { return time < 0 ? GST_CLOCK_TIME_NONE : guint64(time); }

ObjectOptions options_of(const Settings& settings) {
  ObjectOptions options;
  options.min_size = settings.object_min_size;
  options.appear_seconds = settings.object_appear_time;
  options.stop_seconds = settings.object_stop_time;
  options.gone_seconds = settings.object_gone_time;
  options.grace_seconds = settings.motion_end_time;
  return options;
}

int default_least_area(const GstVideoInfo& info) {
  const double pixels = double(GST_VIDEO_INFO_WIDTH(&info)) * GST_VIDEO_INFO_HEIGHT(&info);
  return int(std::ceil(std::max(4.0, pixels / 2000)));
}

}  // namespace

void ObjectWatch::begin(const GstVideoInfo& info, bool live) {
  info_ = info;
  live_ = live;
  any_ = false;
  events_.clear();
  shown_.clear();
  frame_.reset();
}

void ObjectWatch::close() {
  mask_ = {};
  residual_ = {};
  finder_ = {};
  events_ = {};
  shown_ = {};
  frame_.reset();
  any_ = false;
}

void ObjectWatch::follow_time(const GstSegment& segment, GstClockTime timestamp) {
  const gint64 before = now_.clock;
  now_ = {timestamp};
  if (segment.format == GST_FORMAT_TIME && GST_CLOCK_TIME_IS_VALID(timestamp)) {
    now_.running = gst_segment_to_running_time(&segment, GST_FORMAT_TIME, timestamp);
    now_.stream = gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, timestamp);
  }
  now_.clock =
      GST_CLOCK_TIME_IS_VALID(now_.running) ? gint64(now_.running) : before + step_of(info_);
  if (any_) now_.clock = std::max(now_.clock, before + 1);
}

void ObjectWatch::look(LeavingFrame* frame, const Settings& settings, const GstSegment& segment,
                       GstClockTime timestamp) {
  const int width = GST_VIDEO_INFO_WIDTH(&info_), height = GST_VIDEO_INFO_HEIGHT(&info_);
  const ObjectOptions options = options_of(settings);
  // Who begins to listen is told of all that appears from now on.
  if (!any_ || settings.object_messages != tells_) tracker_.begin(width, height, options);
  follow_time(segment, timestamp);
  any_ = true;
  tells_ = settings.object_messages;
  attaches_ = settings.regions;
  const int wanted = settings.regions_min_area;
  least_area_ = wanted > 0 ? wanted : default_least_area(info_);
  tracker_.set_options(options);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const guint8 *mask = nullptr, *residual = nullptr;
  if (attaches_) {
    mask_.resize(pixels);
    residual_.resize(pixels);
    frame->foreground(mask_.data(), residual_.data());
    mask = mask_.data(), residual = residual_.data();
  } else {
    // Distances are for regions alone.
    mask = frame->mask();
  }
  int least = attaches_ ? least_area_ : G_MAXINT;
  if (tells_) least = std::min(least, ObjectTracker::least_area(height, options));
  const std::vector<Region>& regions = finder_.find(mask, residual, width, height, least, true);
  removed_.clear();
  const Pose pose = settings.wishes.stabilize_output ? Pose() : frame->pose();
  UncoveredPlace place;
  while (live_ && frame->next_uncovered(&place))
    removed_.push_back(
        {{place.x - pose.x, place.y - pose.y, double(place.width), double(place.height)},
         double(place.stood) * double(step_of(info_)) / double(GST_SECOND)});
  const gint64 stamp = GST_CLOCK_TIME_IS_VALID(now_.stream) ? gint64(now_.stream) : -1;
  const auto& events = tracker_.push({regions, removed_, now_.clock, stamp});
  shown_.clear();
  for (const Object& object : tracker_.objects()) {
    const Pixels box(object.box);
    const Region region = {int(box.x), int(box.y), int(box.width), int(box.height)};
    // What is chosen leaves out the edges of what comes in.
    const bool is_left_out = wanted == 0 && is_strip_at_edge(region, width, height);
    if (attaches_ && object.area >= least_area_ && !is_left_out) shown_.push_back(&object);
  }
  std::sort(shown_.begin(), shown_.end(), [](const Object* a, const Object* b) {
    return a->area > b->area || (a->area == b->area && a->id < b->id);
  });
  if (!tells_) return;
  events_.insert(events_.end(), events.begin(), events.end());
  const bool pictured = std::any_of(events.begin(), events.end(), [](const ObjectEvent& event) {
    return !is_of_picture(event) && event.kind != ObjectEvent::Kind::gone;
  });
  if (!settings.object_snapshots || !pictured) return;
  frame_.reset(gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info_), nullptr));
  if (!frame_) return;
  const MappedVideoFrame mapped(&info_, frame_.get(), GST_MAP_WRITE);
  if (mapped) frame->write_frame(levels_of(info_), mapped.view<guint8>());
}

void ObjectWatch::attach(GstBuffer* buffer) const {
#ifdef QDMD_HAVE_ANALYTICS
  if (attaches_)
    attach_analytics(buffer, {&shown_, mask_.data(), GST_VIDEO_INFO_WIDTH(&info_),
                              GST_VIDEO_INFO_HEIGHT(&info_)});
#endif
  for (const Object* object : shown_) {
    const Pixels box(object->box);
    auto* meta = gst_buffer_add_video_region_of_interest_meta(buffer, "foreground", box.x, box.y,
                                                              box.width, box.height);
    meta->id = object->id;
    gst_video_region_of_interest_meta_add_param(
        meta,
        gst_structure_new(
            "foreground", "area", G_TYPE_UINT, guint(object->area), "mean-residual", G_TYPE_DOUBLE,
            object->mean_residual, "share", G_TYPE_DOUBLE, share_of(*object), "age", G_TYPE_UINT64,
            guint64(now_.clock - object->first_time), "speed", G_TYPE_DOUBLE, speed_of(*object),
            "standing", G_TYPE_UINT64,
            object->standing_since == kNoTime ? 0 : guint64(now_.clock - object->standing_since),
            "appeared", G_TYPE_BOOLEAN, gboolean(object->appeared), "shares-region", G_TYPE_BOOLEAN,
            gboolean(object->shares_region), nullptr));
  }
}

// The frame, cut to the box; null where that cannot be.
GstSample* ObjectWatch::snapshot_of(const ObjectBox& box, const GstVideoInfo& info) const {
  const Pixels at(box);
  const auto width = guint(GST_VIDEO_INFO_WIDTH(&info)),
             height = guint(GST_VIDEO_INFO_HEIGHT(&info));
  const guint x = std::min(at.x, width - 1), y = std::min(at.y, height - 1);
  const guint w = std::min(at.width, width - x), h = std::min(at.height, height - y);
  GstVideoInfo cut;
  if (!gst_video_info_set_format(&cut, GST_VIDEO_INFO_FORMAT(&info), w, h)) return nullptr;
  // Converters of frames want one rate.
  cut.fps_n = info.fps_n;
  cut.fps_d = info.fps_d;
  cut.colorimetry = info.colorimetry;
  cut.chroma_site = info.chroma_site;
  BufferPtr buffer(gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&cut), nullptr));
  if (!buffer) return nullptr;
  {
    const MappedVideoFrame from(&info, frame_.get(), GST_MAP_READ);
    const MappedVideoFrame to(&cut, buffer.get(), GST_MAP_WRITE);
    if (!from || !to) return nullptr;
    GstVideoConverter* converter = gst_video_converter_new(
        &info, &cut,
        gst_structure_new("cut", GST_VIDEO_CONVERTER_OPT_SRC_X, G_TYPE_INT, gint(x),
                          GST_VIDEO_CONVERTER_OPT_SRC_Y, G_TYPE_INT, gint(y),
                          GST_VIDEO_CONVERTER_OPT_SRC_WIDTH, G_TYPE_INT, gint(w),
                          GST_VIDEO_CONVERTER_OPT_SRC_HEIGHT, G_TYPE_INT, gint(h), nullptr));
    if (!converter) return nullptr;
    gst_video_converter_frame(converter, &from.frame(), const_cast<GstVideoFrame*>(&to.frame()));
    gst_video_converter_free(converter);
  }
  GST_BUFFER_PTS(buffer.get()) = now_.timestamp;
  const CapsPtr caps(gst_video_info_to_caps(&cut));
  return gst_sample_new(buffer.get(), caps.get(), nullptr, nullptr);
}

void ObjectWatch::post(GstElement* element, const ObjectEvent& event, GstSample* snapshot) const {
  GstStructure* fields = gst_structure_new(
      "qdmdbackground-object", "event", G_TYPE_STRING, name_of(event.kind), "timestamp",
      G_TYPE_UINT64, guint64(now_.timestamp), "stream-time", G_TYPE_UINT64, guint64(now_.stream),
      "running-time", G_TYPE_UINT64, guint64(now_.running), "cut-off", G_TYPE_BOOLEAN,
      gboolean(event.cut_off), nullptr);
  if (!is_of_picture(event)) {
    const Object& object = event.object;
    const Pixels box(object.box);
    const bool timed = GST_CLOCK_TIME_IS_VALID(now_.running);
    gst_structure_set(
        fields, "id", G_TYPE_UINT, guint(object.id), "x", G_TYPE_UINT, box.x, "y", G_TYPE_UINT,
        box.y, "width", G_TYPE_UINT, box.width, "height", G_TYPE_UINT, box.height, "area",
        G_TYPE_UINT, guint(object.area), "speed", G_TYPE_DOUBLE, speed_of(object),
        "first-stream-time", G_TYPE_UINT64, told(object.first_stamp), "first-running-time",
        G_TYPE_UINT64, timed ? told(object.first_time) : GST_CLOCK_TIME_NONE, "standing-since",
        G_TYPE_UINT64, timed ? told(object.standing_since) : GST_CLOCK_TIME_NONE, nullptr);
  }
  if (snapshot) gst_structure_set(fields, "snapshot", GST_TYPE_SAMPLE, snapshot, nullptr);
  gst_element_post_message(element, gst_message_new_element(GST_OBJECT(element), fields));
}

void ObjectWatch::tell(GstElement* element, const GstVideoInfo& info) {
  for (const ObjectEvent& event : events_) {
    GstSample* snapshot = nullptr;
    if (frame_ && !is_of_picture(event) && event.kind != ObjectEvent::Kind::gone)
      snapshot = snapshot_of(event.object.box, info);
    post(element, event, snapshot);
    if (snapshot) gst_sample_unref(snapshot);
  }
  events_.clear();
  frame_.reset();
}

void ObjectWatch::cut_off(GstElement* element) {
  if (!any_) return;
  any_ = false;
  shown_.clear();
  frame_.reset();
  try {
    const std::vector<ObjectEvent>& events = tracker_.end();
    if (tells_) events_.insert(events_.end(), events.begin(), events.end());
  } catch (const std::bad_alloc&) {
    // Nobody is told; what comes is new.
    tracker_.begin(GST_VIDEO_INFO_WIDTH(&info_), GST_VIDEO_INFO_HEIGHT(&info_), {});
  }
  tell(element, info_);
}

}  // namespace qdmd
