// SPDX-License-Identifier: LGPL-2.1-or-later
/**
 * SECTION:element-qdmdseparate
 * @title: qdmdseparate
 * @short_description: Separates background and foreground of video into several streams at once
 *
 * qdmdseparate does what #qdmdbackground does, by default with #GstQdmdSeparate:method `robust`. It
 * has one window and one model for all pictures that are wanted. It has the pads `background`,
 * `foreground`, `mask` and `cutout`, which can be requested and released at any time. Each pad
 * sends one buffer for each frame, with the frame's own timestamps, flags and metadata. The
 * pictures of one frame leave one after the other, so no pad is ahead of another by more than a
 * frame. A pad that is not linked costs nothing; one whose downstream has ended does not stop the
 * others.
 *
 * Each pad has caps of its own: the format of the input, or another layout of the same colours,
 * such as RGB as RGBA with a cut-out's transparency, or I420 as NV12. Masks may be GRAY8 beside any
 * format.
 *
 * All pads are served by one thread: put a queue behind each. Without them a sink that waits for
 * its first frame, or for its time, keeps the other pads from theirs, and a pipeline with two sinks
 * never starts. Where the streams meet again, as in a compositor, a queue of a few frames is
 * enough: the pictures of a frame leave together.
 *
 * ## Example launch lines
 * |[
 * gst-launch-1.0 qdmdscenesrc num-buffers=200 ! qdmdseparate name=s window-size=50 \
 *     s.background ! queue ! videoconvert ! autovideosink \
 *     s.mask ! queue ! videoconvert ! autovideosink
 * ]| The background and the mask of one stream.
 *
 * Since: 0.1
 */
#include "gst/gstqdmdseparate.h"

#include <gst/base/gstflowcombiner.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <mutex>
#include <utility>

#include "gst/gstqdmdelement.h"
#include "gst/gstqdmdframes.h"
#include "gst/gstqdmdoutlet.h"

GST_DEBUG_CATEGORY(qdmd_separate_debug);
#define GST_CAT_DEFAULT qdmd_separate_debug

namespace {

using qdmd::Output;

struct Kind {
  const char* name;
  Output output;
};
// In the order in which a frame's pictures are made and pushed: what is decided for masks helps the
// others.
constexpr Kind kKinds[] = {{"mask", Output::mask},
                           {"cutout", Output::cutout},
                           {"background", Output::background},
                           {"foreground", Output::foreground}};
constexpr size_t kCount = std::size(kKinds);
static_assert(kCount <= qdmd::OutputPictures::kMost);

struct UnrefOutlet {
  void operator()(GstQdmdOutlet* outlet) const { gst_object_unref(outlet); }
};
using OutletPtr = std::unique_ptr<GstQdmdOutlet, UnrefOutlet>;

// One picture a frame for each pad.
class SeparateState : public qdmd::State {
 public:
  explicit SeparateState(GstElement* self)
      : State(self, &segment_), combiner_(gst_flow_combiner_new()) {
    gst_segment_init(&segment_, GST_FORMAT_UNDEFINED);
  }
  ~SeparateState() override { gst_flow_combiner_unref(combiner_); }

  GstPad* sink = nullptr;  // the element's own

  // Any thread.
  void add(size_t kind, GstQdmdOutlet* outlet) {
    const std::lock_guard lock(combiner_lock_);
    gst_flow_combiner_add_pad(combiner_, GST_PAD(outlet));
    GST_OBJECT_LOCK(element);
    outlets_[kind] = outlet;
    GST_OBJECT_UNLOCK(element);
  }
  // Any thread. The caller holds a reference.
  void remove(GstQdmdOutlet* outlet) {
    GST_OBJECT_LOCK(element);
    for (GstQdmdOutlet*& one : outlets_)
      if (one == outlet) one = nullptr;
    GST_OBJECT_UNLOCK(element);
    const std::lock_guard lock(combiner_lock_);
    gst_flow_combiner_remove_pad(combiner_, GST_PAD(outlet));
  }
  // Any thread. Null: there is none.
  OutletPtr outlet(size_t kind) const {
    GST_OBJECT_LOCK(element);
    GstQdmdOutlet* outlet = outlets_[kind];
    if (outlet) gst_object_ref(outlet);
    GST_OBJECT_UNLOCK(element);
    return OutletPtr(outlet);
  }
  template <typename See>
  void each(See see) const {
    for (size_t kind = 0; kind < kCount; ++kind)
      if (const OutletPtr one = outlet(kind)) see(one.get());
  }
  void sync() {
    each([this](GstQdmdOutlet* outlet) { qdmd::sync_outlet(outlet, sink, shells); });
  }
  void set_segment(const GstSegment& its) { segment_ = its; }
  void forget_flows() {
    goes_on_ = true;
    const std::lock_guard lock(combiner_lock_);
    gst_flow_combiner_reset(combiner_);
  }

  bool wants_masks(const qdmd::Settings&) const override {
    bool wants = false;
    each([&](GstQdmdOutlet* outlet) {
      const Output output = qdmd::output_of(outlet);
      wants |= (output == Output::mask || output == Output::cutout) &&
               gst_pad_is_linked(GST_PAD(outlet));
    });
    return wants;
  }
  bool wants_masks_alone(const qdmd::Settings&) const override {
    bool mask = false, others = false;
    each([&](GstQdmdOutlet* outlet) {
      if (gst_pad_is_linked(GST_PAD(outlet)))
        (qdmd::output_of(outlet) == Output::mask ? mask : others) = true;
    });
    return mask && !others;
  }
  GstFlowReturn make_pictures(GstBuffer* shell, const qdmd::Settings&,
                              qdmd::OutputPictures* pictures) override {
    for (size_t kind = 0; kind < kCount; ++kind) {
      Leaving& one = leaving_[kind];
      one = {outlet(kind), GST_FLOW_NOT_LINKED};
      if (!one.outlet) continue;
      qdmd::sync_outlet(one.outlet.get(), sink, shells);
      qdmd::BufferPtr buffer;
      one.flow = qdmd::take_buffer(one.outlet.get(), shell, &buffer);
      if (one.flow == GST_FLOW_OK)
        pictures->add({kKinds[kind].output, qdmd::info_of(one.outlet.get()), std::move(buffer)});
    }
    return GST_FLOW_OK;
  }
  GstFlowReturn send(qdmd::OutputPictures* pictures) override {
    auto picture = pictures->begin();
    for (Leaving& one : leaving_)
      if (one.outlet && one.flow == GST_FLOW_OK)
        one.flow = gst_pad_push(GST_PAD(one.outlet.get()), (picture++)->buffer.release());
    // Where there is no pad.
    GstFlowReturn flow = GST_FLOW_NOT_LINKED;
    bool some = false, none = true;
    for (Leaving& one : leaving_) {
      const OutletPtr outlet = std::move(one.outlet);
      if (!outlet) continue;
      qdmd::note_flow(outlet.get(), one.flow);
      const std::lock_guard lock(combiner_lock_);
      // One that was released meanwhile says nothing.
      if (!is_mine(outlet.get())) continue;
      flow = gst_flow_combiner_update_pad_flow(combiner_, GST_PAD(outlet.get()), one.flow);
      some |= one.flow == GST_FLOW_OK;
      none = none && one.flow == GST_FLOW_NOT_LINKED;
    }
    goes_on_ = some || none;
    return flow;
  }
  void forward(qdmd::EventPtr event) override {
    sync();
    gst_pad_event_default(sink, GST_OBJECT(element), event.release());
  }
  void keep(qdmd::EventPtr event) override {
    each([&](GstQdmdOutlet* outlet) { gst_pad_store_sticky_event(GST_PAD(outlet), event.get()); });
  }
  // What one pad met is not the others' affair. And where nobody listens, nobody misses a frame.
  bool goes_on(GstFlowReturn) const override { return goes_on_; }

 private:
  struct Leaving {
    OutletPtr outlet;
    GstFlowReturn flow = GST_FLOW_NOT_LINKED;
  };

  bool is_mine(const GstQdmdOutlet* outlet) const {
    GST_OBJECT_LOCK(element);
    const bool mine =
        std::find(std::begin(outlets_), std::end(outlets_), outlet) != std::end(outlets_);
    GST_OBJECT_UNLOCK(element);
    return mine;
  }

  // Protected by the object lock; the element's own.
  GstQdmdOutlet* outlets_[kCount] = {};
  // The object lock may be taken inside it.
  std::mutex combiner_lock_;
  GstFlowCombiner* const combiner_;
  // Protected by the stream lock.
  GstSegment segment_;
  Leaving leaving_[kCount];
  bool goes_on_ = true;
};

}  // namespace

// What GLib aligns instances to.
static_assert(alignof(SeparateState) <= 16);
struct _GstQdmdSeparate {
  GstElement parent;
  // As qdmdbackground's.
  SeparateState state;
};

#define gst_qdmd_separate_parent_class parent_class
G_DEFINE_TYPE_WITH_CODE(GstQdmdSeparate, gst_qdmd_separate, GST_TYPE_ELEMENT,
                        GST_DEBUG_CATEGORY_INIT(qdmd_separate_debug, "qdmdseparate", 0,
                                                "Q-DMD background separation, many pads"))
GST_ELEMENT_REGISTER_DEFINE(qdmdseparate, "qdmdseparate", GST_RANK_NONE, GST_TYPE_QDMD_SEPARATE)

static SeparateState& state_of(gpointer element) { return GST_QDMD_SEPARATE(element)->state; }

// ---- Frames -------------------------------------------------------------------------------------

static GstFlowReturn gst_qdmd_separate_chain(GstPad*, GstObject* parent, GstBuffer* input) {
  SeparateState& state = state_of(parent);
  qdmd::BufferPtr buffer(input);
  if (!state.engine.configured()) return GST_FLOW_NOT_NEGOTIATED;
  GstFlowReturn flow = qdmd::prepare_for(state, input);
  if (flow == GST_FLOW_OK) flow = qdmd::take_frame(state, std::move(buffer));
  return flow == GST_FLOW_OK ? qdmd::send_ready(state) : flow;
}

// ---- Events -------------------------------------------------------------------------------------

static gboolean gst_qdmd_separate_take_caps(SeparateState& state, GstCaps* caps) {
  const qdmd::CapsPtr before(gst_pad_get_current_caps(state.sink));
  const bool same = before && state.engine.configured() && gst_caps_is_equal(before.get(), caps);
  if (same) return TRUE;
  GstVideoInfo info;
  const bool known = gst_video_info_from_caps(&info, caps);
  qdmd::before_caps(state, known ? &info : nullptr);
  if (!known) {
    qdmd::tell_of_caps(state.element, caps);
    return FALSE;
  }
  if (!qdmd::begin_video(state, info, caps)) return FALSE;
  state.sync();
  state.each([caps](GstQdmdOutlet* outlet) { qdmd::negotiate_outlet(outlet, caps); });
  return TRUE;
}

static gboolean gst_qdmd_separate_sink_event(GstPad* pad, GstObject* parent, GstEvent* event) {
  SeparateState& state = state_of(parent);
  if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS) {
    GstCaps* caps = nullptr;
    gst_event_parse_caps(event, &caps);
    const gboolean taken = gst_qdmd_separate_take_caps(state, caps);
    gst_event_unref(event);
    return taken;
  }
  // Others come from any thread.
  if (!GST_EVENT_IS_SERIALIZED(event)) return gst_pad_event_default(pad, parent, event);

  qdmd::before_event(state, event);
  switch (GST_EVENT_TYPE(event)) {
    case GST_EVENT_SEGMENT: {
      const GstSegment* segment = nullptr;
      gst_event_parse_segment(event, &segment);
      state.set_segment(*segment);
      state.each(qdmd::reopen_outlet);
      break;
    }
    case GST_EVENT_FLUSH_STOP: {
      GstSegment none;
      gst_segment_init(&none, GST_FORMAT_UNDEFINED);
      state.set_segment(none);
      state.forget_flows();
      state.each(qdmd::reopen_outlet);
      return gst_pad_event_default(pad, parent, event);
    }
    case GST_EVENT_STREAM_START:
      state.forget_flows();
      state.each([&](GstQdmdOutlet* outlet) {
        qdmd::reopen_outlet(outlet);
        qdmd::sync_outlet(outlet, state.sink, state.shells);
        qdmd::start_stream(outlet, event);
      });
      gst_event_unref(event);
      return TRUE;
    default:
      break;
  }
  if (qdmd::hold_event(state, event)) return TRUE;
  state.sync();
  return gst_pad_event_default(pad, parent, event);
}

// ---- Queries ------------------------------------------------------------------------------------

static void answer_caps(GstQuery* query, qdmd::CapsPtr caps) {
  GstCaps* filter = nullptr;
  gst_query_parse_caps(query, &filter);
  if (filter) caps.reset(gst_caps_intersect_full(filter, caps.get(), GST_CAPS_INTERSECT_FIRST));
  gst_query_set_caps_result(query, caps.get());
}

// What every pad's downstream can be given something of.
static void gst_qdmd_separate_answer_sink_caps(SeparateState& state, GstQuery* query) {
  const qdmd::CapsPtr all(gst_pad_get_pad_template_caps(state.sink));
  qdmd::CapsPtr caps(gst_caps_ref(all.get()));
  state.each([&](GstQdmdOutlet* outlet) {
    if (!gst_pad_is_linked(GST_PAD(outlet))) return;
    const qdmd::CapsPtr taken(gst_pad_peer_query_caps(GST_PAD(outlet), all.get()));
    const qdmd::CapsPtr needed(qdmd::caps_needed(qdmd::output_of(outlet), taken.get()));
    // Pads come before the template, which wants nothing.
    caps.reset(gst_caps_intersect_full(needed.get(), caps.get(), GST_CAPS_INTERSECT_FIRST));
  });
  answer_caps(query, std::move(caps));
}

static void gst_qdmd_separate_answer_src_caps(SeparateState& state, GstPad* pad, GstQuery* query) {
  qdmd::CapsPtr input(gst_pad_get_current_caps(state.sink));
  const qdmd::CapsPtr all(gst_pad_get_pad_template_caps(state.sink));
  if (!input) input.reset(gst_pad_peer_query_caps(state.sink, all.get()));
  input.reset(gst_caps_intersect_full(input.get(), all.get(), GST_CAPS_INTERSECT_FIRST));
  const Output output = qdmd::output_of(GST_QDMD_OUTLET(pad));
  answer_caps(query, qdmd::CapsPtr(qdmd::caps_given(output, input.get())));
}

static gboolean gst_qdmd_separate_sink_query(GstPad* pad, GstObject* parent, GstQuery* query) {
  SeparateState& state = state_of(parent);
  switch (GST_QUERY_TYPE(query)) {
    case GST_QUERY_CAPS:
      gst_qdmd_separate_answer_sink_caps(state, query);
      return TRUE;
    case GST_QUERY_ALLOCATION:
      // Frames are copied: any strides do, and no buffer is kept.
      gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
      return TRUE;
    default:
      return gst_pad_query_default(pad, parent, query);
  }
}

static gboolean gst_qdmd_separate_src_query(GstPad* pad, GstObject* parent, GstQuery* query) {
  SeparateState& state = state_of(parent);
  switch (GST_QUERY_TYPE(query)) {
    case GST_QUERY_LATENCY:
      return qdmd::answer_latency(state, state.sink, query);
    case GST_QUERY_CAPS:
      gst_qdmd_separate_answer_src_caps(state, pad, query);
      return TRUE;
    default:
      return gst_pad_query_default(pad, parent, query);
  }
}

// ---- Pads and states ----------------------------------------------------------------------------

static GstPad* gst_qdmd_separate_request_new_pad(GstElement* element, GstPadTemplate* its,
                                                 const gchar*, const GstCaps*) {
  SeparateState& state = state_of(element);
  size_t kind = 0;
  while (g_strcmp0(kKinds[kind].name, GST_PAD_TEMPLATE_NAME_TEMPLATE(its)) != 0)
    if (++kind == kCount) return nullptr;
  if (state.outlet(kind)) return nullptr;
  GstPad* pad = qdmd::make_outlet(its, kKinds[kind].output);
  gst_pad_set_query_function(pad, gst_qdmd_separate_src_query);
  gst_pad_set_active(pad, TRUE);
  // The streaming thread pushes to it as soon as it is there.
  gst_object_ref_sink(pad);
  if (!gst_element_add_pad(element, pad)) {
    gst_object_unref(pad);
    return nullptr;
  }
  state.add(kind, GST_QDMD_OUTLET(pad));
  gst_object_unref(pad);
  return pad;
}

static void gst_qdmd_separate_release_pad(GstElement* element, GstPad* pad) {
  gst_object_ref(pad);
  state_of(element).remove(GST_QDMD_OUTLET(pad));
  gst_pad_set_active(pad, FALSE);
  gst_element_remove_pad(element, pad);
  gst_object_unref(pad);
}

static GstStateChangeReturn gst_qdmd_separate_change_state(GstElement* element,
                                                           GstStateChange change) {
  SeparateState& state = state_of(element);
  if (change == GST_STATE_CHANGE_READY_TO_PAUSED) {
    state.forget_flows();
    if (!qdmd::start(state)) return GST_STATE_CHANGE_FAILURE;
  }
  const GstStateChangeReturn changed =
      GST_ELEMENT_CLASS(parent_class)->change_state(element, change);
  const bool failed = changed == GST_STATE_CHANGE_FAILURE;
  if (change == GST_STATE_CHANGE_PAUSED_TO_READY ||
      (change == GST_STATE_CHANGE_READY_TO_PAUSED && failed)) {
    GST_PAD_STREAM_LOCK(state.sink);
    qdmd::close(state);
    state.each(qdmd::reset_outlet);
    GST_PAD_STREAM_UNLOCK(state.sink);
  }
  return changed;
}

// ---- Class --------------------------------------------------------------------------------------

static void gst_qdmd_separate_finalize(GObject* object) {
  std::destroy_at(&GST_QDMD_SEPARATE(object)->state);
  G_OBJECT_CLASS(parent_class)->finalize(object);
}

static void gst_qdmd_separate_init(GstQdmdSeparate* self) {
  GstElement* element = GST_ELEMENT(self);
  std::construct_at(&self->state, element);
  GstPadTemplate* its = gst_element_class_get_pad_template(GST_ELEMENT_GET_CLASS(self), "sink");
  GstPad* sink = self->state.sink = gst_pad_new_from_template(its, "sink");
  gst_pad_set_chain_function(sink, gst_qdmd_separate_chain);
  gst_pad_set_event_function(sink, gst_qdmd_separate_sink_event);
  gst_pad_set_query_function(sink, gst_qdmd_separate_sink_query);
  // A pad whose downstream does not take them does not stop the others.
  GST_PAD_SET_ACCEPT_TEMPLATE(sink);
  // Video without a framerate is video, too.
  GST_PAD_SET_ACCEPT_INTERSECT(sink);
  gst_element_add_pad(element, sink);
}

static void gst_qdmd_separate_class_init(GstQdmdSeparateClass* klass) {
  GstElementClass* element_class = GST_ELEMENT_CLASS(klass);
  G_OBJECT_CLASS(klass)->finalize = gst_qdmd_separate_finalize;
  qdmd::install_properties_and_signals(G_OBJECT_CLASS(klass), qdmd::WhichSettings::without_output);
  gst_element_class_set_static_metadata(
      element_class, "Q-DMD background separator with several outputs", "Filter/Effect/Video",
      "Separates background and foreground of video from a static camera by quaternion dynamic "
      "mode decomposition, into up to four streams at once",
      "The gst-qdmd authors <gst-qdmd@localhost>");
  GstCaps* caps = gst_caps_from_string(QDMD_CAPS);
  gst_element_class_add_pad_template(
      element_class, gst_pad_template_new("sink", GST_PAD_SINK, GST_PAD_ALWAYS, caps));
  for (const Kind& kind : kKinds)
    gst_element_class_add_pad_template(
        element_class, gst_pad_template_new_with_gtype(kind.name, GST_PAD_SRC, GST_PAD_REQUEST,
                                                       caps, GST_TYPE_QDMD_OUTLET));
  gst_caps_unref(caps);

  element_class->request_new_pad = GST_DEBUG_FUNCPTR(gst_qdmd_separate_request_new_pad);
  element_class->release_pad = GST_DEBUG_FUNCPTR(gst_qdmd_separate_release_pad);
  element_class->change_state = GST_DEBUG_FUNCPTR(gst_qdmd_separate_change_state);
}
