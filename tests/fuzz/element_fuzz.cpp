// SPDX-License-Identifier: LGPL-2.1-or-later
// Fuzz target: both elements, with any caps, buffers, events, queries, properties, states and flows
// in any order, where memory runs out and downstream refuses.
#include <gst/gst.h>
#include <gst/video/video.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "tests/core/allocator.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/outlet.h"

namespace {

namespace allocator = qdmd::test::allocator;
using qdmd::fuzz::Bytes;
using qdmd::fuzz::Outlet;

// The ordinary ones first, as many as kOrdinary; then deep ones, and some that it does not take.
constexpr int kOrdinary = 23;
const char* const kFormats[] = {
    "RGB",       "RGBx",      "BGRx",      "xRGB",      "xBGR",      "RGBA",      "BGRA",
    "ARGB",      "ABGR",      "BGR",       "GBR",       "I420",      "YV12",      "NV12",
    "NV21",      "Y42B",      "NV16",      "YUY2",      "UYVY",      "Y444",      "AYUV",
    "A420",      "GRAY8",     "GBRA",      "P010_10LE", "v210",      "GRAY16_LE", "ENCODED",
    "I420_10LE", "I422_10LE", "Y444_10LE", "I420_12LE", "I422_12LE", "Y444_12LE", "P012_LE",
    "Y444_16LE", "P016_LE",   "RGBA64_LE", "ARGB64"};
const char* const kPads[] = {"mask", "cutout", "background", "foreground"};

class ElementTrial {
 public:
  explicit ElementTrial(Bytes* bytes) : bytes_(*bytes) {
    many_ = bytes_.once_in(2);
    element_ = gst_element_factory_make(many_ ? "qdmdseparate" : "qdmdbackground", nullptr);
    QDMD_DEMAND(element_);
    gst_object_ref_sink(element_);
    bus_ = gst_bus_new();
    gst_element_set_bus(element_, bus_);
    g_object_set(element_, "window-size", guint(bytes_.from(2, 5)), "n-threads",
                 guint(bytes_.from(1, 2)), nullptr);
    sink_ = gst_element_get_static_pad(element_, "sink");
    source_ = gst_pad_new("up", GST_PAD_SRC);
    gst_object_ref_sink(source_);
    gst_pad_set_query_function(source_, answer_upstream);
    gst_pad_set_event_function(source_, swallow);
    gst_pad_link(source_, sink_);
    gst_pad_set_active(source_, TRUE);
    if (many_) {
      open(bytes_.below(4));
      if (bytes_.once_in(2)) open(bytes_.below(4));
    } else {
      outlets_[0].connect(gst_element_get_static_pad(element_, "src"), &number_);
    }
  }

  void run() {
    set_state(GST_STATE_PLAYING);
    if (!bytes_.once_in(8)) {
      push_event(gst_event_new_stream_start("fuzz"));
      send_caps();
      send_segment();
    }
    for (int calls = 0; calls < 64 && !bytes_.empty(); ++calls) {
      const bool failing = bytes_.once_in(24);
      if (failing) {
        allocator::start();
        allocator::fail(bytes_.from(1, 32),
                        bytes_.once_in(2) ? allocator::Failing::all : allocator::Failing::one);
      }
      step();
      if (failing) {
        allocator::fail_no_more();
        allocator::stop();
      }
      clear_bus();
    }
  }

  ~ElementTrial() {
    if (bytes_.once_in(2)) push_event(gst_event_new_eos());
    set_state(GST_STATE_NULL);
    gst_pad_set_active(source_, FALSE);
    gst_pad_unlink(source_, sink_);
    for (Outlet& outlet : outlets_) outlet.disconnect();
    gst_element_set_bus(element_, nullptr);
    gst_object_unref(bus_);
    gst_object_unref(source_);
    gst_object_unref(sink_);
    // Nobody else holds it.
    QDMD_DEMAND(GST_OBJECT_REFCOUNT_VALUE(element_) == 1);
    gst_object_unref(element_);
  }

 private:
  // ---- Pads ----

  void open(int i) {
    if (!many_ || outlets_[i].connected()) return;
    GstPad* source = gst_element_request_pad_simple(element_, kPads[i]);
    if (source) outlets_[i].connect(source, &number_);
  }
  Outlet* some_outlet() {
    Outlet& outlet = outlets_[many_ ? bytes_.below(4) : 0];
    return outlet.connected() ? &outlet : nullptr;
  }
  static gboolean answer_upstream(GstPad* pad, GstObject* parent, GstQuery* query) {
    if (GST_QUERY_TYPE(query) != GST_QUERY_LATENCY)
      return gst_pad_query_default(pad, parent, query);
    gst_query_set_latency(query, TRUE, 0, GST_CLOCK_TIME_NONE);
    return TRUE;
  }
  static gboolean swallow(GstPad*, GstObject*, GstEvent* event) {
    gst_event_unref(event);
    return TRUE;
  }

  // ---- Steps ----

  void set_state(GstState state) {
    gst_element_set_state(element_, state);
    if (state <= GST_STATE_READY)
      for (Outlet& outlet : outlets_) outlet.forget_caps();
  }
  void push_event(GstEvent* event) {
    // A new stream counts anew for nobody: numbers go on.
    gst_pad_push_event(source_, event);
  }
  GstCaps* any_caps() {
    const char* format =
        kFormats[bytes_.below(bytes_.once_in(4) ? int{std::size(kFormats)} : kOrdinary)];
    const bool any = bytes_.once_in(12);
    const int width = any ? bytes_.any_int() : bytes_.from(1, 17);
    const int height = any ? bytes_.any_int() : bytes_.from(1, 17);
    static const int rates[][2] = {{25, 1}, {0, 1}, {30000, 1001}, {1, 10}, {G_MAXINT, 1}};
    const auto& rate = rates[bytes_.once_in(4) ? bytes_.below(5) : 0];
    GstCaps* caps = gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING, format, "width",
                                        G_TYPE_INT, width, "height", G_TYPE_INT, height,
                                        "framerate", GST_TYPE_FRACTION, rate[0], rate[1], nullptr);
    if (bytes_.once_in(16))
      gst_caps_set_simple(caps, "interlace-mode", G_TYPE_STRING,
                          bytes_.once_in(2) ? "interleaved" : "fields", nullptr);
    if (bytes_.once_in(16))
      gst_caps_set_simple(caps, "colorimetry", G_TYPE_STRING,
                          bytes_.once_in(2) ? "bt709" : "1:1:0:0", nullptr);
    if (bytes_.once_in(16))
      gst_structure_remove_field(gst_caps_get_structure(caps, 0),
                                 bytes_.once_in(2) ? "width" : "framerate");
    return caps;
  }
  void send_caps() {
    GstCaps* caps = any_caps();
    GstVideoInfo info;
    // As large as that only to be refused.
    const bool known = gst_video_info_from_caps(&info, caps);
    if (!known || info.size < 100000) {
      has_info_ = known;
      info_ = info;
      push_event(gst_event_new_caps(caps));
    } else {
      g_object_set(element_, "max-memory", guint64{100000}, nullptr);
      push_event(gst_event_new_caps(caps));
      g_object_set(element_, "max-memory", guint64{1} << 32, nullptr);
      has_info_ = false;
    }
    gst_caps_unref(caps);
  }
  void send_segment() {
    GstSegment segment;
    gst_segment_init(&segment, bytes_.once_in(12) ? GST_FORMAT_BYTES : GST_FORMAT_TIME);
    if (bytes_.once_in(8)) segment.rate = -1;
    if (bytes_.once_in(8)) segment.start = segment.position = bytes_.word();
    if (bytes_.once_in(8)) segment.stop = segment.start + bytes_.word();
    // GStreamer asserts that what runs backwards has an end.
    if (segment.rate < 0 && segment.stop == GST_CLOCK_TIME_NONE)
      segment.stop = segment.start + GST_SECOND;
    push_event(gst_event_new_segment(&segment));
  }

  void push(bool odd) {
    gsize size = has_info_ ? info_.size : bytes_.byte();
    if (odd) {
      switch (bytes_.below(4)) {
        case 0:
          size = bytes_.byte();
          break;
        case 1:
          size -= std::min<gsize>(size, gsize(bytes_.below(8)));
          break;
        case 2:
          size += gsize(bytes_.byte());
          break;
        default:
          size += 512;
      }
    }
    // Some come in several pieces.
    GstBuffer* buffer = gst_buffer_new();
    for (gsize left = size; left > 0;) {
      const gsize part =
          odd && bytes_.once_in(2) ? std::min<gsize>(left, bytes_.byte() + 1u) : left;
      gst_buffer_append_memory(buffer, gst_allocator_alloc(nullptr, part, nullptr));
      left -= part;
    }
    gst_buffer_memset(buffer, 0, bytes_.byte(), size);
    if (size > 0) gst_buffer_memset(buffer, bytes_.byte() % size, bytes_.byte(), 1 + size / 3);
    if (odd && has_info_ && bytes_.once_in(2)) add_meta(buffer);
    if (odd && bytes_.once_in(4))
      gst_buffer_add_video_region_of_interest_meta(buffer, "face", bytes_.word(), bytes_.word(),
                                                   bytes_.word(), bytes_.byte());
    if (odd && bytes_.once_in(4)) time_ = bytes_.once_in(2) ? bytes_.word() : time_ << 20;
    GST_BUFFER_PTS(buffer) = odd && bytes_.once_in(4) ? GST_CLOCK_TIME_NONE : time_;
    GST_BUFFER_DURATION(buffer) = GST_SECOND / 25;
    if (odd && bytes_.once_in(4)) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
    if (odd && bytes_.once_in(8)) GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_GAP);
    time_ += GST_SECOND / 25;
    GST_BUFFER_OFFSET(buffer) = guint64(number_++);
    gst_pad_push(source_, buffer);
  }
  // Strides and offsets, most of which fit into the buffer.
  void add_meta(GstBuffer* buffer) {
    gsize offset[GST_VIDEO_MAX_PLANES];
    gint stride[GST_VIDEO_MAX_PLANES];
    for (guint i = 0; i < GST_VIDEO_MAX_PLANES; ++i) {
      offset[i] = info_.offset[i];
      stride[i] = info_.stride[i];
      if (bytes_.once_in(4)) offset[i] += gsize(bytes_.below(64));
      if (bytes_.once_in(4)) stride[i] += bytes_.below(16);
      if (bytes_.once_in(32)) offset[i] = bytes_.word();
      if (bytes_.once_in(32)) stride[i] = bytes_.any_int();
    }
    guint width = guint(info_.width), height = guint(info_.height);
    if (bytes_.once_in(16)) width += guint(bytes_.from(-1, 1));
    if (bytes_.once_in(16)) height += guint(bytes_.from(-1, 1));
    const auto format = bytes_.once_in(16) ? GST_VIDEO_FORMAT_RGBA : GST_VIDEO_INFO_FORMAT(&info_);
    const guint planes = bytes_.once_in(16) ? guint(bytes_.from(1, 4)) : info_.finfo->n_planes;
    gst_buffer_add_video_meta_full(buffer, GST_VIDEO_FRAME_FLAG_NONE, format, width, height, planes,
                                   offset, stride);
  }

  void send_event() {
    switch (bytes_.below(14)) {
      case 0:
        push_event(gst_event_new_eos());
        break;
      case 1:
        push_event(gst_event_new_flush_start());
        if (!bytes_.once_in(4)) push_event(gst_event_new_flush_stop(bytes_.once_in(2)));
        if (!bytes_.once_in(4)) send_segment();
        break;
      case 2:
        push_event(gst_event_new_flush_stop(TRUE));
        break;
      case 3:
        push_event(gst_event_new_gap(time_, GST_SECOND));
        break;
      case 4:
        push_event(gst_event_new_stream_start(bytes_.once_in(2) ? "fuzz" : "other"));
        break;
      case 5:
        push_event(gst_event_new_segment_done(GST_FORMAT_TIME, gint64(time_)));
        break;
      case 6:
        push_event(gst_event_new_tag(gst_tag_list_new(GST_TAG_TITLE, "a title", nullptr)));
        break;
      case 7:
        push_event(gst_event_new_custom(
            bytes_.once_in(2) ? GST_EVENT_CUSTOM_DOWNSTREAM : GST_EVENT_CUSTOM_DOWNSTREAM_OOB,
            gst_structure_new_empty("fuzz")));
        break;
      case 8:
        send_segment();
        break;
      case 9:
        push_event(gst_event_new_latency(bytes_.word()));
        break;
      default: {
        Outlet* outlet = some_outlet();
        if (!outlet) return;
        GstEvent* event = nullptr;
        switch (bytes_.below(4)) {
          case 0:
            event =
                gst_event_new_seek(bytes_.once_in(2) ? 1 : -1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                   GST_SEEK_TYPE_SET, bytes_.word(), GST_SEEK_TYPE_NONE, 0);
            break;
          case 1:
            event = gst_event_new_qos(GST_QOS_TYPE_UNDERFLOW, 2, GST_SECOND, time_);
            break;
          case 2:
            event = gst_event_new_reconfigure();
            break;
          default:
            event = gst_event_new_latency(bytes_.word());
        }
        outlet->push_event(event);
      }
    }
  }

  void ask() {
    GstQuery* query = nullptr;
    switch (bytes_.below(8)) {
      case 0:
        query = gst_query_new_latency();
        break;
      case 1: {
        GstCaps* filter = bytes_.once_in(2) ? any_caps() : nullptr;
        query = gst_query_new_caps(filter);
        if (filter) gst_caps_unref(filter);
        break;
      }
      case 2: {
        GstCaps* caps = any_caps();
        query = gst_query_new_accept_caps(caps);
        gst_caps_unref(caps);
        break;
      }
      case 3: {
        GstCaps* caps = any_caps();
        query = gst_query_new_allocation(caps, bytes_.once_in(2));
        gst_caps_unref(caps);
        break;
      }
      case 4:
        query = gst_query_new_position(GST_FORMAT_TIME);
        break;
      case 5:
        query = gst_query_new_drain();
        break;
      case 6:
        query = gst_query_new_duration(GST_FORMAT_BYTES);
        break;
      default:
        query = gst_query_new_custom(GST_QUERY_CUSTOM, gst_structure_new_empty("fuzz"));
    }
    Outlet* outlet = some_outlet();
    if (bytes_.once_in(2) || !outlet || GST_QUERY_TYPE(query) == GST_QUERY_ALLOCATION ||
        GST_QUERY_TYPE(query) == GST_QUERY_DRAIN)
      gst_pad_peer_query(source_, query);
    else
      outlet->ask(query);
    gst_query_unref(query);
  }

  // A value of the property's type, within its range or not: GObject refuses what is not.
  void set_property(GParamSpec* spec) {
    GValue value = G_VALUE_INIT;
    g_value_init(&value, G_PARAM_SPEC_VALUE_TYPE(spec));
    if (G_IS_PARAM_SPEC_ENUM(spec)) {
      const GEnumClass* values = G_PARAM_SPEC_ENUM(spec)->enum_class;
      g_value_set_enum(&value, values->values[unsigned(bytes_.byte()) % values->n_values].value);
    } else if (G_IS_PARAM_SPEC_BOOLEAN(spec)) {
      g_value_set_boolean(&value, bytes_.once_in(2));
    } else if (G_IS_PARAM_SPEC_UINT(spec)) {
      const GParamSpecUInt* its = G_PARAM_SPEC_UINT(spec);
      const bool large = bytes_.once_in(12) && g_strcmp0(spec->name, "n-threads") != 0;
      g_value_set_uint(
          &value,
          std::min(its->maximum, large ? its->maximum : its->minimum + guint(bytes_.below(6))));
    } else if (G_IS_PARAM_SPEC_UINT64(spec)) {
      g_value_set_uint64(&value, bytes_.once_in(2) ? guint64{1} << 32 : bytes_.word());
    } else if (G_IS_PARAM_SPEC_DOUBLE(spec)) {
      g_value_set_double(&value, bytes_.any_double());
    } else if (G_IS_PARAM_SPEC_STRING(spec)) {
      static const char* const texts[] = {"", "/nowhere/at/all", "/dev/null", "/", "face"};
      g_value_set_string(&value, bytes_.once_in(6) ? file() : texts[bytes_.below(5)]);
    } else if (GST_IS_PARAM_SPEC_ARRAY_LIST(spec)) {
      for (int count = bytes_.below(4); count > 0; --count) {
        GValue rectangle = G_VALUE_INIT;
        g_value_init(&rectangle, GST_TYPE_ARRAY);
        for (int numbers = bytes_.once_in(8) ? bytes_.below(6) : 4; numbers > 0; --numbers) {
          GValue number = G_VALUE_INIT;
          g_value_init(&number, G_TYPE_INT);
          g_value_set_int(&number, bytes_.any_int());
          gst_value_array_append_and_take_value(&rectangle, &number);
        }
        gst_value_array_append_and_take_value(&value, &rectangle);
      }
    }
    g_object_set_property(G_OBJECT(element_), spec->name, &value);
    g_value_unset(&value);
  }
  void use_property() {
    guint count = 0;
    GParamSpec** specs = g_object_class_list_properties(G_OBJECT_GET_CLASS(element_), &count);
    GParamSpec* spec = specs[bytes_.byte() % count];
    g_free(specs);
    if (spec->owner_type != G_OBJECT_TYPE(element_)) return;
    if (spec->flags & G_PARAM_WRITABLE && !bytes_.once_in(3)) {
      set_property(spec);
      return;
    }
    GValue value = G_VALUE_INIT;
    g_object_get_property(G_OBJECT(element_), spec->name, &value);
    g_value_unset(&value);
  }

  static const char* file() {
    static const std::string name =
        std::string(g_get_tmp_dir()) + "/qdmd-fuzz-" + std::to_string(getpid());
    return name.c_str();
  }
  void emit() {
    gboolean done = FALSE;
    static const char* const places[] = {"/dev/full", "/nowhere/at/all", "/dev/null", ""};
    switch (bytes_.below(4)) {
      case 0:
        g_signal_emit_by_name(element_, "reset");
        break;
      case 1:
        g_signal_emit_by_name(element_, "save", places[bytes_.below(4)], &done);
        break;
      case 2:
        g_signal_emit_by_name(element_, "save", file(), &done);
        saved_ = saved_ || done;
        break;
      default:
        g_signal_emit_by_name(element_, "load",
                              bytes_.once_in(4) ? places[bytes_.below(4)] : file(), &done);
    }
  }

  void step() {
    switch (bytes_.below(32)) {
      case 0:
        send_caps();
        break;
      case 1:
      case 2:
        send_event();
        break;
      case 3:
      case 4:
        ask();
        break;
      case 5:
      case 6:
      case 7:
        use_property();
        break;
      case 8:
        // Upstream begins anew after it.
        set_state(static_cast<GstState>(bytes_.from(GST_STATE_NULL, GST_STATE_PLAYING)));
        break;
      case 9:
        if (Outlet* outlet = some_outlet()) {
          static const GstFlowReturn flows[] = {
              GST_FLOW_OK,    GST_FLOW_OK,         GST_FLOW_EOS,           GST_FLOW_FLUSHING,
              GST_FLOW_ERROR, GST_FLOW_NOT_LINKED, GST_FLOW_NOT_NEGOTIATED};
          outlet->answer_with(flows[bytes_.below(7)]);
        }
        break;
      case 10:
        emit();
        break;
      case 11:
        if (bytes_.once_in(2))
          open(bytes_.below(4));
        else if (many_)
          outlets_[bytes_.below(4)].disconnect();
        break;
      case 12:
        if (Outlet* outlet = some_outlet()) {
          GstCaps* caps = bytes_.once_in(2) ? any_caps() : nullptr;
          if (caps && bytes_.once_in(2)) {
            gst_caps_unref(caps);
            caps = gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING,
                                       kFormats[bytes_.below(kOrdinary)], nullptr);
          }
          outlet->take_only(caps, bytes_.once_in(2));
        }
        break;
      case 13:
        set_state(GST_STATE_PLAYING);
        push_event(gst_event_new_stream_start("again"));
        send_caps();
        send_segment();
        break;
      case 14:
      case 15:
        push(true);
        break;
      default:
        push(false);
    }
  }
  // Each message has a text.
  void clear_bus() {
    while (GstMessage* message = gst_bus_pop(bus_)) {
      if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
        GError* error = nullptr;
        gst_message_parse_error(message, &error, nullptr);
        QDMD_DEMAND(error && error->message && *error->message);
        g_error_free(error);
      }
      gst_message_unref(message);
    }
  }

  Bytes& bytes_;
  bool many_ = false, has_info_ = false, saved_ = false;
  GstElement* element_ = nullptr;
  GstBus* bus_ = nullptr;
  GstPad *sink_ = nullptr, *source_ = nullptr;
  Outlet outlets_[4];
  GstVideoInfo info_ = {};
  GstClockTime time_ = 0;
  gint64 number_ = 0;
};

// What GLib says of misuse by a harness is none of the element's; what it calls critical is.
void hear_log(const gchar* domain, GLogLevelFlags level, const gchar* text, gpointer) {
  if (!(level & (G_LOG_LEVEL_CRITICAL | G_LOG_LEVEL_ERROR))) return;
  // gst_video_frame_map() asserts that a buffer's metadata names the format of the caps.
  if (domain && std::strcmp(domain, "GStreamer-Video") == 0) return;
  // A value out of range is refused; newer versions of GLib call that critical.
  if (std::strstr(text, "is invalid or out of range for property")) return;
  std::fprintf(stderr, "%s: %s\n", domain ? domain : "", text);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char***) {
  // No other plugins, and no registry that another process writes, too.
  g_setenv("GST_REGISTRY_FORK", "no", FALSE);
  g_setenv("GST_REGISTRY_UPDATE", "no", FALSE);
  g_setenv("GST_REGISTRY_1_0", "/nowhere/registry", FALSE);
  g_setenv("GST_PLUGIN_SYSTEM_PATH_1_0", "", FALSE);
  (void)argc;
  gst_init(nullptr, nullptr);
  g_log_set_default_handler(hear_log, nullptr);
  GError* error = nullptr;
  GstPlugin* plugin = gst_plugin_load_file(QDMD_PLUGIN, &error);
  if (!plugin) std::fprintf(stderr, "%s\n", error->message);
  QDMD_DEMAND(plugin);
  gst_object_unref(plugin);
  QDMD_DEMAND(allocator::see_only("libgstqdmd.so"));
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Bytes bytes(data, size);
  ElementTrial(&bytes).run();
  return 0;
}
