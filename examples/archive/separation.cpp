// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/separation.h"

#include <gst/app/gstappsrc.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "examples/archive/element_options.h"
#include "examples/archive/files.h"
#include "examples/archive/frame_reader.h"
#include "examples/archive/video_writer.h"

namespace qdmd::archive {
namespace {

// Frames that wait for the element before the reader does.
constexpr guint64 kMostWaiting = 4;

const char* pad_of(Output output) {
  switch (output) {
    case Output::background:
      return "background";
    case Output::foreground:
      return "foreground";
    case Output::mask:
      return "mask";
    case Output::cutout:
      break;
  }
  return "cutout";
}

// The element and what it writes to. Every frame that is pushed leaves each of its pads once, in
// order: they are counted.
class Separation {
 public:
  Separation(const SeparationOptions& options, const Plan& plan, size_t index)
      : options_(options), info_(info_of(plan.caps)), stretch_(plan.stretches[index]) {
    std::string description = "appsrc name=source format=time max-bytes=0 max-buffers=0";
    for (size_t i = 0; i < options.wanted.size(); ++i) {
      const std::string number = std::to_string(i);
      const Wanted& one = options.wanted[i];
      const bool is_mask = one.output == Output::mask;
      description += " queue name=in" + number +
                     " max-size-buffers=8 max-size-bytes=0 max-size-time=0" +
                     (is_mask ? " ! video/x-raw,format=GRAY8 ! " : " ! ");
      description += one.is_picture() ? "fakesink async=false"
                                      : encoding(options.encoder, is_mask ? grey(info_) : info_) +
                                            " ! filesink async=false name=out" + number;
    }
    pipeline_ = make_pipeline(description);
    source_ = element_of(pipeline_, "source");
    const CapsPtr caps(gst_caps_from_string(plan.caps.c_str()));
    gst_app_src_set_caps(GST_APP_SRC(source_.get()), caps.get());
    GstElement* const element = make_element(options.properties);
    gst_bin_add(GST_BIN(pipeline_.get()), element);
    gst_object_unref(element);
    gst_element_link(source_.get(), element);
    for (size_t i = 0; i < options.wanted.size(); ++i) {
      const std::string number = std::to_string(i);
      const Wanted& one = options.wanted[i];
      auto branch = std::make_unique<Branch>();
      branch->warm_up = stretch_.warm_up;
      branch->begin = element_of(pipeline_, ("in" + number).c_str());
      const PadPtr pad(gst_element_get_static_pad(branch->begin.get(), "sink"));
      gst_pad_add_probe(pad.get(), GST_PAD_PROBE_TYPE_BUFFER, Branch::on_frame, branch.get(),
                        nullptr);
      if (!gst_element_link_pads(element, pad_of(one.output), branch->begin.get(), "sink"))
        throw std::runtime_error(one.path + " cannot be written");
      branch->first = stretch_.first;
      branch->window = one.is_picture() ? options.window : 0;
      if (one.is_picture()) {
        picture_path_ = one.path;
      } else {
        branch->path = part_of(one.path, index);
        g_object_set(element_of(pipeline_, ("out" + number).c_str()).get(), "location",
                     temporary_of(branch->path).c_str(), nullptr);
      }
      branches_.push_back(std::move(branch));
    }
    if (gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE) {
      has_ended(pipeline_, GST_SECOND, kWhat);
      throw std::runtime_error(kWhat);
    }
  }

  // Its threads look at the branches.
  ~Separation() { gst_element_set_state(pipeline_.get(), GST_STATE_NULL); }
  Separation(const Separation&) = delete;
  Separation& operator=(const Separation&) = delete;

  void push(GstBuffer* frame, GstClockTime time) {
    GstBuffer* const buffer = gst_buffer_copy(frame);
    GST_BUFFER_PTS(buffer) = time;
    GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
    GST_BUFFER_FLAG_UNSET(buffer, GST_BUFFER_FLAG_DISCONT);
    write_pictures();
    while (gst_app_src_get_current_level_buffers(GST_APP_SRC(source_.get())) >= kMostWaiting)
      wait(2 * GST_MSECOND);
    if (gst_app_src_push_buffer(GST_APP_SRC(source_.get()), buffer) == GST_FLOW_OK) return;
    has_ended(pipeline_, GST_SECOND, kWhat);
    throw std::runtime_error(kWhat);
  }

  // No more than so many frames behind those to warm up are the stretch's own.
  void limit(int64_t frames) {
    for (auto& branch : branches_) branch->frames = frames;
  }
  // Own frames that have left from all pads.
  int64_t written() const {
    int64_t least = std::numeric_limits<int64_t>::max();
    for (const auto& branch : branches_) least = std::min(least, branch->left - branch->warm_up);
    return std::max<int64_t>(least, 0);
  }

  // All own frames have left, or, where the recording is over, leave now: their files are whole
  // afterwards.
  void end(bool is_over) {
    if (is_over) {
      gst_app_src_end_of_stream(GST_APP_SRC(source_.get()));
    } else {
      for (auto& branch : branches_) {
        const PadPtr pad(gst_element_get_static_pad(branch->begin.get(), "sink"));
        gst_pad_send_event(pad.get(), gst_event_new_eos());
      }
    }
    while (!wait(10 * GST_MSECOND)) {
    }
    gst_element_set_state(pipeline_.get(), GST_STATE_NULL);
    for (auto& branch : branches_) branch->end_window();
    write_pictures();
    for (auto& branch : branches_)
      if (!branch->path.empty()) give_name(branch->path);
  }

 private:
  // From a pad of the element on.
  struct Branch {
    std::string path;
    ElementPtr begin;
    int64_t warm_up = 0, first = 0;
    int window = 0;  // frames, each last one of which is a picture; 0: there are none
    std::atomic<int64_t> left{0}, frames{std::numeric_limits<int64_t>::max()};
    std::mutex lock;
    std::vector<std::pair<int64_t, BufferPtr>> pictures;  // of windows
    BufferPtr newest;                                     // of a window that has not ended

    static GstPadProbeReturn on_frame(GstPad*, GstPadProbeInfo* info, gpointer data) {
      auto* const branch = static_cast<Branch*>(data);
      const int64_t own = branch->left++ - branch->warm_up;
      if (own < 0 || own >= branch->frames) return GST_PAD_PROBE_DROP;
      if (branch->window > 0) {
        branch->newest.reset(gst_buffer_ref(GST_PAD_PROBE_INFO_BUFFER(info)));
        if ((branch->first + own + 1) % branch->window == 0) branch->end_window();
      }
      return GST_PAD_PROBE_OK;
    }
    void end_window() {
      if (!newest) return;
      const std::lock_guard held(lock);
      const int64_t frame = first + std::min<int64_t>(left - warm_up, frames) - 1;
      pictures.emplace_back(frame / window, std::move(newest));
    }
  };
  static constexpr const char* kWhat = "the recording cannot be separated";

  static GstVideoInfo grey(const GstVideoInfo& info) {
    GstVideoInfo grey;
    gst_video_info_set_format(&grey, GST_VIDEO_FORMAT_GRAY8,
                              static_cast<guint>(GST_VIDEO_INFO_WIDTH(&info)),
                              static_cast<guint>(GST_VIDEO_INFO_HEIGHT(&info)));
    return grey;
  }

  // True: all files are whole.
  bool wait(GstClockTime time) {
    write_pictures();
    return has_ended(pipeline_, time, kWhat);
  }

  void write_pictures() {
    for (auto& branch : branches_) {
      std::unique_lock held(branch->lock);
      const auto pictures = std::exchange(branch->pictures, {});
      held.unlock();
      for (const auto& [window, picture] : pictures) {
        const std::string path = picture_of(picture_path_, window);
        write_png(temporary_of(path), info_, picture.get());
        give_name(path);
      }
    }
  }

  const SeparationOptions& options_;
  const GstVideoInfo info_;
  const Stretch stretch_;
  PipelinePtr pipeline_;
  ElementPtr source_;
  std::string picture_path_;
  std::vector<std::unique_ptr<Branch>> branches_;
};

// False, and nothing of it counts: after a seek, frames are not those that were planned.
bool separate_from(const SeparationOptions& options, const Plan& plan, size_t index, bool seeks,
                   const std::function<void(int64_t)>& at_work, int64_t* written) {
  const Stretch& stretch = plan.stretches[index];
  const bool is_last = index + 1 == plan.stretches.size();
  const GstVideoInfo info = info_of(plan.caps);
  FrameReader reader(options.recordings, options.rate, &info);
  Place place;
  if (plan.by_time) place.trusts_times = true;
  if (seeks) place = stretch.place;
  reader.begin_at(place);

  std::unique_ptr<Separation> separation;
  const int64_t begin = stretch.first - stretch.warm_up;
  // Frames that were read of all; of those to warm up, and of the own ones.
  int64_t read = 0, warm_up = 0, own = 0;
  bool is_over = false, limited = false;
  const auto is_before = [&](GstClockTime time, int64_t number) {
    return plan.by_time ? reader.time() < time : read - 1 < number;
  };
  while (!limited || separation->written() < own) {
    is_over = !reader.next();
    if (is_over) break;
    ++read;
    if (is_before(stretch.warm_up_time, begin)) continue;
    if (!separation) {
      if (seeks && reader.time() != stretch.warm_up_time) return false;
      separation = std::make_unique<Separation>(options, plan, index);
    }
    if (is_before(stretch.first_time, stretch.first)) {
      ++warm_up;
    } else if (is_last || is_before(stretch.end_time, stretch.first + stretch.frames)) {
      ++own;
    } else if (!limited) {
      if (seeks && own != stretch.frames) return false;
      separation->limit(own);
      limited = true;
    }
    separation->push(reader.buffer(), reader.time());
    at_work(std::min(separation->written(), own));
  }
  *written = own;
  if (seeks && (warm_up != stretch.warm_up || own != stretch.frames)) return false;
  if (own > 0) separation->end(is_over);
  return true;
}

}  // namespace

int64_t separate(const SeparationOptions& options, const Plan& plan, size_t index,
                 const std::function<void(int64_t)>& at_work) {
  // Where decoders and demuxers do not do as they should, all is decoded from the start: after a
  // time that this process wasted once.
  static bool seeks = true;
  int64_t written = 0;
  const Place& place = plan.stretches[index].place;
  const bool elsewhere = place.file > 0 || GST_CLOCK_TIME_IS_VALID(place.seek);
  if (plan.by_time && elsewhere && seeks) {
    seeks = separate_from(options, plan, index, true, at_work, &written);
    if (seeks) return written;
  }
  separate_from(options, plan, index, false, at_work, &written);
  return written;
}

}  // namespace qdmd::archive
