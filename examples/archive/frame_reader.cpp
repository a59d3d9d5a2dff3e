#include "examples/archive/frame_reader.h"

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <mutex>
#include <stdexcept>

#include "examples/archive/picture_file.h"

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

// Crops begin and end at such rows, and so many rows away from those that are wanted: chroma that
// rows share is then converted as in the whole picture.
constexpr int kAround = 16;

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

// In what frames like these are kept: all of their colours, as the element takes them. Of pictures,
// which may be grey now and then: colour ones.
GstVideoFormat kept_format(const GstVideoInfo& info, bool pictures) {
  if (GST_VIDEO_INFO_IS_GRAY(&info) && !pictures) return GST_VIDEO_FORMAT_GRAY8;
  if (!GST_VIDEO_INFO_IS_YUV(&info)) return GST_VIDEO_FORMAT_BGRx;
  if (GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, 1) != 1) return GST_VIDEO_FORMAT_Y444;
  return GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, 1) == 1 ? GST_VIDEO_FORMAT_I420
                                                         : GST_VIDEO_FORMAT_Y42B;
}

CharsPtr text_of(const GstVideoColorimetry& colours) {
  return CharsPtr(gst_video_colorimetry_to_string(&colours));
}

// What pictures of the size and colours of `info` are, in frames of that format.
GstVideoInfo picture_info(const GstVideoInfo& info, GstVideoFormat format) {
  GstVideoInfo picture;
  gst_video_info_set_format(&picture,
                            format == GST_VIDEO_FORMAT_BGRx ? GST_VIDEO_FORMAT_RGB : format,
                            static_cast<guint>(GST_VIDEO_INFO_WIDTH(&info)),
                            static_cast<guint>(GST_VIDEO_INFO_HEIGHT(&info)));
  // Grey ones that become R, G and B have those of R, G and B.
  if (GST_VIDEO_INFO_IS_RGB(&picture) == GST_VIDEO_INFO_IS_RGB(&info))
    picture.colorimetry = info.colorimetry;
  picture.chroma_site = info.chroma_site;
  picture.interlace_mode = info.interlace_mode;
  GST_VIDEO_INFO_FIELD_ORDER(&picture) = GST_VIDEO_INFO_FIELD_ORDER(&info);
  picture.par_n = info.par_n;
  picture.par_d = info.par_d;
  return picture;
}

// What all frames are converted to.
CapsPtr caps_of(GstVideoFormat format, const GstVideoInfo& picture) {
  CapsPtr caps(gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING,
                                   gst_video_format_to_string(format), nullptr));
  if (const CharsPtr colours = text_of(picture.colorimetry))
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

// What the streaming thread tells of the picture before it is cropped, and the rows that are left.
struct FrameReader::Crop {
  std::mutex lock;
  std::function<Rows(const RecordingInfo&)> choose;
  bool pictures = false;
  ElementPtr element, between, format;
  CapsPtr kept;  // once known
  RecordingInfo first;
  bool known = false;
  Rows wanted, left;
  std::string refused;

  // With the lock.
  void set(const GstVideoInfo& seen) {
    const int width = GST_VIDEO_INFO_WIDTH(&seen), height = GST_VIDEO_INFO_HEIGHT(&seen);
    if (known && (width != first.width || height != first.height)) {
      refused = "frames of " + std::to_string(width) + "x" + std::to_string(height) +
                " follow frames of " + std::to_string(first.width) + "x" +
                std::to_string(first.height) + ": a recording has one size";
      return;
    }
    if (!known) {
      const GstVideoFormat like_this = kept_format(seen, pictures);
      first = {width, height, 0, picture_info(seen, like_this)};
      if (GST_VIDEO_INFO_FPS_N(&seen) > 0)
        first.rate = double(GST_VIDEO_INFO_FPS_N(&seen)) / GST_VIDEO_INFO_FPS_D(&seen);
      known = true;
      kept = caps_of(like_this, first.picture);
      wanted = choose(first);
      left.first = std::max(0, wanted.first / kAround * kAround - kAround);
      const int end = (wanted.first + wanted.count + 2 * kAround - 1) / kAround * kAround;
      left.count = std::min(height, end) - left.first;
    }
    // GStreamer 1.22 takes samples of full range as they are for those of limited range, and the
    // other way round, unless R, G and B are between them.
    const bool other_range = !GST_VIDEO_INFO_IS_RGB(&seen) &&
                             !GST_VIDEO_INFO_IS_RGB(&first.picture) &&
                             seen.colorimetry.range != first.picture.colorimetry.range;
    const CapsPtr way(other_range ? gst_caps_from_string("video/x-raw,format=ARGB64")
                                  : gst_caps_new_any());
    g_object_set(between.get(), "caps", way.get(), nullptr);
    g_object_set(format.get(), "caps", kept.get(), nullptr);
    g_object_set(element.get(), "top", left.first, "bottom", height - left.first - left.count,
                 nullptr);
  }

  static GstPadProbeReturn on_event(GstPad*, GstPadProbeInfo* probe, gpointer data) {
    GstEvent* const event = GST_PAD_PROBE_INFO_EVENT(probe);
    if (GST_EVENT_TYPE(event) != GST_EVENT_CAPS) return GST_PAD_PROBE_OK;
    GstCaps* caps = nullptr;
    gst_event_parse_caps(event, &caps);
    GstVideoInfo info;
    if (!gst_video_info_from_caps(&info, caps)) return GST_PAD_PROBE_OK;
    auto* const crop = static_cast<Crop*>(data);
    const std::lock_guard held(crop->lock);
    try {
      crop->set(info);
    } catch (const std::exception& error) {
      crop->refused = error.what();
    }
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

FrameReader::FrameReader(std::vector<std::string> paths, double rate,
                         std::function<Rows(const RecordingInfo&)> choose)
    : rate_(rate), choose_(std::move(choose)), crop_(std::make_unique<Crop>()) {
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
  crop_->pictures = pictures_;
  crop_->choose = [this](const RecordingInfo& info) { return choose_(info); };
}

FrameReader::~FrameReader() {
  frame_.reset();
  // The pipeline's threads look at the crop.
  pipeline_.reset();
}

// The next file, or all pictures.
void FrameReader::open() {
  const std::string end =
      " ! videocrop name=crop ! videoconvert ! capsfilter name=between ! videoconvert ! "
      "capsfilter name=format ! "
      "appsink name=sink sync=false max-buffers=2";
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
    const std::lock_guard held(crop_->lock);
    crop_->element = element_of(pipeline_, "crop");
    crop_->between = element_of(pipeline_, "between");
    crop_->format = element_of(pipeline_, "format");
  }
  if (!pictures_) g_object_set(source_.get(), "location", files_[next_file_++].c_str(), nullptr);
  GstPad* const pad = gst_element_get_static_pad(crop_->element.get(), "sink");
  gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, Crop::on_event, crop_.get(), nullptr);
  gst_object_unref(pad);
  // A decoder may want the next picture before it gives one.
  if (pictures_) feed();
  if (gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE)
    has_ended(pipeline_, GST_SECOND, "cannot read the recording");
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
    note_early_end();
    pipeline_.reset();
    begin_ = end_;
    if (pictures_) return false;
  }
}

bool FrameReader::next_of_file() {
  constexpr GstClockTime kPatience = 100 * GST_MSECOND;
  const std::string what =
      next_file_ > 0 ? files_[next_file_ - 1] + " cannot be decoded" : "cannot read the recording";
  if (pictures_) feed();
  for (;;) {
    SamplePtr sample(gst_app_sink_try_pull_sample(GST_APP_SINK(sink_.get()), kPatience));
    {
      const std::lock_guard held(crop_->lock);
      if (!crop_->refused.empty()) throw std::runtime_error(crop_->refused);
    }
    if (sample) {
      take(std::move(sample));
      return true;
    }
    // An error comes before the end that it brings.
    has_ended(pipeline_, 0, what);
    if (gst_app_sink_is_eos(GST_APP_SINK(sink_.get()))) return false;
  }
}

void FrameReader::take(SamplePtr sample) {
  sample_ = std::move(sample);
  GstBuffer* const buffer = gst_sample_get_buffer(sample_.get());
  GstVideoInfo info;
  const bool is_video = gst_video_info_from_caps(&info, gst_sample_get_caps(sample_.get()));
  if (is_video) frame_.emplace(&info, buffer, GST_MAP_READ);
  if (!is_video || !*frame_) throw std::runtime_error("a decoded frame cannot be read");
  if (!known_) {
    const std::lock_guard held(crop_->lock);
    info_ = crop_->first;
    known_ = true;
  }
  if (info_.rate <= 0) info_.rate = rate_;
  const auto length = static_cast<GstClockTime>(std::llround(GST_SECOND / info_.rate));
  const GstSegment* const segment = gst_sample_get_segment(sample_.get());
  const GstClockTime shown =
      GST_BUFFER_PTS_IS_VALID(buffer)
          ? gst_segment_to_stream_time(segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer))
          : GST_CLOCK_TIME_NONE;
  time_ = GST_CLOCK_TIME_IS_VALID(shown) ? begin_ + shown : end_;
  // Times grow, whatever a file says.
  if (end_ > 0 && time_ + length / 2 < end_) time_ = end_;
  end_ = time_ + length;
}

ImageView FrameReader::view() const {
  ImageView view = frame_->view<const uint8_t>();
  Rows wanted, left;
  {
    const std::lock_guard held(crop_->lock);
    wanted = crop_->wanted;
    left = crop_->left;
  }
  // Pixels that share a sample are wanted together.
  const auto down = [&](int c) {
    const Spacing at = view.spacing(c);
    return (wanted.first - left.first) / at.rows * at.row_stride;
  };
  for (int c = 0; c < 3; ++c) view.channel[c] += down(c);
  if (view.alpha) view.alpha += down(3);
  view.height = wanted.count;
  return view;
}

void FrameReader::note_early_end() {
  // Containers round, and count sound.
  constexpr GstClockTime kLeast = GST_SECOND;
  gint64 duration = 0;
  if (pictures_ || !gst_element_query_duration(pipeline_.get(), GST_FORMAT_TIME, &duration) ||
      duration <= 0)
    return;
  const auto length = static_cast<GstClockTime>(duration), seen = end_ - begin_;
  if (seen + std::max(kLeast, length / 50) < length)
    early_ends_.push_back(files_[next_file_ - 1] + " ends after " +
                          std::to_string(seen / GST_SECOND) + " s of " +
                          std::to_string(length / GST_SECOND) + " s: is it cut off?");
}

double FrameReader::share() const {
  const auto files = static_cast<double>(files_.size());
  if (pictures_) return static_cast<double>(next_file_) / files;
  double of_file = 1;
  gint64 duration = 0;
  if (pipeline_ && gst_element_query_duration(pipeline_.get(), GST_FORMAT_TIME, &duration) &&
      duration > 0)
    of_file = std::min(1.0, static_cast<double>(end_ - begin_) / static_cast<double>(duration));
  return std::max(0.0, static_cast<double>(next_file_) - 1 + of_file) / files;
}

}  // namespace qdmd::archive
