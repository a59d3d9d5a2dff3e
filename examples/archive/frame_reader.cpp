// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/frame_reader.h"

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "examples/archive/picture_file.h"
#include "gst/gstqdmdelement.h"

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return extension;
}

// What GStreamer calls pictures with this extension; or nothing.
std::string media_type_of(const fs::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".png") return "image/png";
  if (extension == ".jpg" || extension == ".jpeg") return "image/jpeg";
  return "";
}

std::string fraction_of(double rate) {
  int numerator = 0, denominator = 1;
  gst_util_double_to_fraction(rate, &numerator, &denominator);
  return std::to_string(numerator) + "/" + std::to_string(denominator);
}

bool takes(GstVideoFormat format) {
  static const CapsPtr caps(gst_caps_from_string(QDMD_CAPS));
  const CapsPtr one(gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING,
                                        gst_video_format_to_string(format), nullptr));
  return gst_caps_can_intersect(one.get(), caps.get()) != FALSE;
}

// In what frames like these are kept: as they are, where the element takes that, else without loss.
// Of pictures, which may be grey now and then: colour ones of 8 bits.
GstVideoFormat kept_format(const GstVideoInfo& info, bool pictures) {
  const bool is_grey = GST_VIDEO_INFO_IS_GRAY(&info), is_yuv = GST_VIDEO_INFO_IS_YUV(&info);
  if (pictures && !is_yuv) return GST_VIDEO_FORMAT_BGRx;
  if (takes(GST_VIDEO_INFO_FORMAT(&info))) return GST_VIDEO_INFO_FORMAT(&info);
  const bool deep = GST_VIDEO_INFO_COMP_DEPTH(&info, 0) > 8;
  if (is_grey) return deep ? GST_VIDEO_FORMAT_GRAY16_LE : GST_VIDEO_FORMAT_GRAY8;
  if (!is_yuv) {
    if (deep) return GST_VIDEO_FORMAT_ARGB64;
    return GST_VIDEO_INFO_HAS_ALPHA(&info) ? GST_VIDEO_FORMAT_BGRA : GST_VIDEO_FORMAT_BGRx;
  }
  if (deep) return GST_VIDEO_FORMAT_Y444_16LE;
  if (GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, 1) != 1) return GST_VIDEO_FORMAT_Y444;
  return GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, 1) == 1 ? GST_VIDEO_FORMAT_I420
                                                         : GST_VIDEO_FORMAT_Y42B;
}

CharsPtr text_of(const GstVideoColorimetry& colours) {
  return CharsPtr(gst_video_colorimetry_to_string(&colours));
}

// What frames become in that format.
GstVideoInfo kept_info(const GstVideoInfo& seen, GstVideoFormat format, double rate) {
  GstVideoInfo kept;
  // Two fields are taken as the frame that they are in.
  gst_video_info_set_format(&kept, format, static_cast<guint>(GST_VIDEO_INFO_WIDTH(&seen)),
                            static_cast<guint>(GST_VIDEO_INFO_HEIGHT(&seen)));
  // Grey ones that become R, G and B have those of R, G and B.
  if (GST_VIDEO_INFO_IS_RGB(&kept) == GST_VIDEO_INFO_IS_RGB(&seen))
    kept.colorimetry = seen.colorimetry;
  kept.chroma_site = seen.chroma_site;
  kept.par_n = seen.par_n;
  kept.par_d = seen.par_d;
  kept.fps_n = seen.fps_n;
  kept.fps_d = seen.fps_d;
  if (seen.fps_n <= 0) gst_util_double_to_fraction(rate, &kept.fps_n, &kept.fps_d);
  return kept;
}

// What all frames are converted to.
CapsPtr caps_of(const GstVideoInfo& kept) {
  CapsPtr caps(gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING,
                                   gst_video_format_to_string(GST_VIDEO_INFO_FORMAT(&kept)),
                                   nullptr));
  if (const CharsPtr colours = text_of(kept.colorimetry))
    gst_caps_set_simple(caps.get(), "colorimetry", G_TYPE_STRING, colours.get(), nullptr);
  return caps;
}

// The pictures of a folder: those of the first kind that there is.
std::vector<std::string> pictures_of(const fs::path& folder) {
  std::vector<std::string> all;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && !media_type_of(entry.path()).empty())
      all.push_back(entry.path().string());
  std::sort(all.begin(), all.end());
  if (all.empty())
    throw std::runtime_error(folder.string() + " has no pictures: no file ends in .png or .jpg");
  for (const std::string& file : all)
    if (media_type_of(file) != media_type_of(all.front()))
      throw std::runtime_error(folder.string() + " has PNG and JPEG pictures: keep one kind in it");
  return all;
}

}  // namespace

// What the streaming thread tells of the frames before they are converted.
struct FrameReader::Kept {
  std::mutex lock;
  bool pictures = false, known = false;
  double rate = 0;
  GstVideoInfo info = {};  // once known
  ElementPtr between, format;
  std::string refused;

  // With the lock.
  void see(const GstVideoInfo& seen) {
    const int width = GST_VIDEO_INFO_WIDTH(&seen), height = GST_VIDEO_INFO_HEIGHT(&seen);
    if (!known) info = kept_info(seen, kept_format(seen, pictures), rate);
    known = true;
    if (width != GST_VIDEO_INFO_WIDTH(&info) || height != GST_VIDEO_INFO_HEIGHT(&info)) {
      refused = "frames of " + std::to_string(width) + "x" + std::to_string(height) +
                " follow frames of " + std::to_string(GST_VIDEO_INFO_WIDTH(&info)) + "x" +
                std::to_string(GST_VIDEO_INFO_HEIGHT(&info)) + ": a recording has one size";
      return;
    }
    // GStreamer 1.22 takes samples of full range as they are for those of limited range, and the
    // other way round, unless R, G and B are between them.
    const bool other_range = !GST_VIDEO_INFO_IS_RGB(&seen) && !GST_VIDEO_INFO_IS_RGB(&info) &&
                             seen.colorimetry.range != info.colorimetry.range;
    const CapsPtr way(other_range ? gst_caps_from_string("video/x-raw,format=ARGB64")
                                  : gst_caps_new_any());
    g_object_set(between.get(), "caps", way.get(), nullptr);
    g_object_set(format.get(), "caps", caps_of(info).get(), nullptr);
  }

  static GstPadProbeReturn on_event(GstPad*, GstPadProbeInfo* probe, gpointer data) {
    GstEvent* const event = GST_PAD_PROBE_INFO_EVENT(probe);
    if (GST_EVENT_TYPE(event) != GST_EVENT_CAPS) return GST_PAD_PROBE_OK;
    GstCaps* caps = nullptr;
    gst_event_parse_caps(event, &caps);
    GstVideoInfo info;
    if (!gst_video_info_from_caps(&info, caps)) return GST_PAD_PROBE_OK;
    auto* const kept = static_cast<Kept*>(data);
    const std::lock_guard held(kept->lock);
    kept->see(info);
    // If nothing says what colours are, GStreamer takes it from the height: from that of the
    // picture.
    const CharsPtr colours = text_of(info.colorimetry);
    if (!colours || gst_structure_has_field(gst_caps_get_structure(caps, 0), "colorimetry"))
      return GST_PAD_PROBE_OK;
    const CapsPtr said(gst_caps_copy(caps));
    gst_caps_set_simple(said.get(), "colorimetry", G_TYPE_STRING, colours.get(), nullptr);
    GST_PAD_PROBE_INFO_DATA(probe) = gst_event_new_caps(said.get());
    gst_event_unref(event);
    return GST_PAD_PROBE_OK;
  }
};

FrameReader::FrameReader(std::vector<std::string> paths, double rate, const GstVideoInfo* like)
    : rate_(rate), kept_(std::make_unique<Kept>()) {
  if (paths.size() == 1 && fs::is_directory(paths.front())) {
    files_ = pictures_of(paths.front());
    pictures_ = true;
  } else {
    files_ = std::move(paths);
    pictures_ = std::all_of(files_.begin(), files_.end(),
                            [](const std::string& file) { return !media_type_of(file).empty(); });
  }
  for (const std::string& file : files_)
    if (!std::ifstream(file))
      throw std::runtime_error(file + " cannot be read: give files, or a folder of pictures");
  kept_->pictures = pictures_;
  kept_->rate = rate;
  if (!like) return;
  kept_->info = *like;
  kept_->known = true;
}

FrameReader::~FrameReader() {
  frame_.reset();
  // The pipeline's threads look at what is kept.
  pipeline_.reset();
}

void FrameReader::begin_at(const Place& place) {
  next_file_ = place.file;
  begin_ = end_ = place.begin;
  seek_ = place.seek;
  trusts_times_ = place.trusts_times;
}

// The next file, or all pictures.
void FrameReader::open() {
  const std::string end =
      " ! videoconvert name=first ! capsfilter name=between ! videoconvert ! "
      "capsfilter name=format ! appsink name=sink sync=false max-buffers=2";
  if (pictures_) {
    const std::string type = media_type_of(files_.front());
    pipeline_ = make_pipeline("appsrc name=source format=time caps=" + type +
                              ",framerate=" + fraction_of(rate_) + " ! " +
                              (type == "image/png" ? "pngdec" : "jpegdec") + end);
  } else {
    pipeline_ = make_pipeline("filesrc name=source ! decodebin" + end);
  }
  source_ = element_of(pipeline_, "source");
  sink_ = element_of(pipeline_, "sink");
  {
    const std::lock_guard held(kept_->lock);
    kept_->between = element_of(pipeline_, "between");
    kept_->format = element_of(pipeline_, "format");
  }
  if (!pictures_) g_object_set(source_.get(), "location", files_[next_file_++].c_str(), nullptr);
  GstPad* const pad = gst_element_get_static_pad(element_of(pipeline_, "first").get(), "sink");
  gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, Kept::on_event, kept_.get(), nullptr);
  gst_object_unref(pad);
  // A decoder may want the next picture before it gives one.
  if (pictures_) feed();
  const GstClockTime seek = std::exchange(seek_, GST_CLOCK_TIME_NONE);
  if (GST_CLOCK_TIME_IS_VALID(seek)) {
    gst_element_set_state(pipeline_.get(), GST_STATE_PAUSED);
    while (gst_element_get_state(pipeline_.get(), nullptr, nullptr, 100 * GST_MSECOND) ==
           GST_STATE_CHANGE_ASYNC)
      has_ended(pipeline_, 0, what_failed());
    // Where it is refused, frames come from the first one on, with their times.
    gst_element_seek_simple(
        pipeline_.get(), GST_FORMAT_TIME,
        GstSeekFlags(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_KEY_UNIT | GST_SEEK_FLAG_SNAP_BEFORE),
        static_cast<gint64>(seek));
  }
  if (gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE)
    has_ended(pipeline_, GST_SECOND, what_failed());
}

std::string FrameReader::what_failed() const {
  return next_file_ > 0 ? files_[next_file_ - 1] + " cannot be decoded"
                        : "cannot read the recording";
}

// One picture into the pipeline; false where there is none.
bool FrameReader::feed() {
  if (next_file_ == files_.size()) {
    gst_app_src_end_of_stream(GST_APP_SRC(source_.get()));
    return false;
  }
  std::ifstream file(files_[next_file_], std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (bytes.empty()) throw std::runtime_error(files_[next_file_] + " is empty, or cannot be read");
  if (is_cut_off(bytes)) throw std::runtime_error(files_[next_file_] + " is cut off");
  if (has_deep_colours(bytes))
    throw std::runtime_error(files_[next_file_] +
                             " has colours of 16 bits, which are not read: convert it to 8 bits");
  GstBuffer* const buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
  GST_BUFFER_PTS(buffer) =
      static_cast<GstClockTime>(std::llround(static_cast<double>(next_file_) * GST_SECOND / rate_));
  GST_BUFFER_DURATION(buffer) = static_cast<GstClockTime>(std::llround(GST_SECOND / rate_));
  ++next_file_;
  gst_app_src_push_buffer(GST_APP_SRC(source_.get()), buffer);
  return true;
}

bool FrameReader::next() {
  frame_.reset();
  sample_.reset();
  for (;;) {
    if (!pipeline_) {
      if (next_file_ == files_.size()) return false;
      open();
    }
    if (next_of_file()) return true;
    pipeline_.reset();
    begin_ = end_;
    if (pictures_) return false;
  }
}

bool FrameReader::next_of_file() {
  constexpr GstClockTime kPatience = 100 * GST_MSECOND;
  for (;;) {
    if (pictures_) feed();
    SamplePtr sample;
    while (!sample) {
      sample.reset(gst_app_sink_try_pull_sample(GST_APP_SINK(sink_.get()), kPatience));
      {
        const std::lock_guard held(kept_->lock);
        if (!kept_->refused.empty()) throw std::runtime_error(kept_->refused);
      }
      if (sample) break;
      // An error comes before the end that it brings.
      has_ended(pipeline_, 0, what_failed());
      if (gst_app_sink_is_eos(GST_APP_SINK(sink_.get()))) return false;
    }
    if (take(std::move(sample))) return true;
  }
}

// False: the frame lies before what was looked for.
bool FrameReader::take(SamplePtr sample) {
  sample_ = std::move(sample);
  const GstBuffer* const buffer = gst_sample_get_buffer(sample_.get());
  const auto length = gst_util_uint64_scale(GST_SECOND, static_cast<guint64>(info().fps_d),
                                            static_cast<guint64>(info().fps_n));
  const GstClockTime shown =
      GST_BUFFER_PTS_IS_VALID(buffer)
          ? gst_segment_to_stream_time(gst_sample_get_segment(sample_.get()), GST_FORMAT_TIME,
                                       GST_BUFFER_PTS(buffer))
          : GST_CLOCK_TIME_NONE;
  if (!GST_CLOCK_TIME_IS_VALID(shown) && trusts_times_) return false;
  time_ = GST_CLOCK_TIME_IS_VALID(shown) ? begin_ + shown : end_;
  // Times grow, whatever a file says.
  if (!trusts_times_ && end_ > 0 && time_ + length / 2 < end_) time_ = end_;
  end_ = time_ + length;
  return true;
}

const GstVideoInfo& FrameReader::info() const {
  const std::lock_guard held(kept_->lock);
  return kept_->info;
}

GstBuffer* FrameReader::buffer() const { return gst_sample_get_buffer(sample_.get()); }

ImageView FrameReader::view() {
  GstVideoInfo info;
  if (gst_video_info_from_caps(&info, gst_sample_get_caps(sample_.get())))
    frame_.emplace(&info, buffer(), GST_MAP_READ);
  if (!frame_ || !*frame_) throw std::runtime_error("a decoded frame cannot be read");
  return frame_->view<const uint8_t>();
}

}  // namespace qdmd::archive
