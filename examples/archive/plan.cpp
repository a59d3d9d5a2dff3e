// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/plan.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "examples/archive/frame_index.h"

namespace qdmd::archive {
namespace {

using Json = nlohmann::ordered_json;

// The scene's memory needs so many windows before pictures are what one process would have made of
// them (docs/archive.md).
constexpr int kWarmUpWindows = 5;
// Masks learn from one row in so many of each frame, in turn (PixelNoise): if a stream begins at
// another row, all masks differ a little, for good.
constexpr int64_t kTurn = 8;
// Where the stretch is chosen, it is at most so many times as long as what warms it up.
constexpr int kMostStretch = 15;
// A frame to warm up takes half of what others take: nothing is made of it.
constexpr int64_t kOfWarmUp = 2;
// Frames whose times are compared with what is decoded.
constexpr size_t kChecked = 64;

GstClockTime length_of(const GstVideoInfo& info) {
  return gst_util_uint64_scale(GST_SECOND, static_cast<guint64>(info.fps_d),
                               static_cast<guint64>(info.fps_n));
}

// All frames of a recording.
struct Frames {
  struct File {
    GstClockTime begin;
    int64_t first;  // frame
    std::vector<GstClockTime> times;
  };
  std::vector<File> files;
  int64_t count = 0;
  bool exact = true;

  // How to find a frame.
  std::pair<Place, GstClockTime> find(int64_t frame) const {
    size_t file = files.size() - 1;
    while (files[file].first > frame) --file;
    const File& its = files[file];
    const GstClockTime time = its.times[static_cast<size_t>(frame - its.first)];
    return {{file, its.begin, time > its.times.front() ? time : GST_CLOCK_TIME_NONE, true},
            its.begin + time};
  }
};

Frames frames_of(const std::vector<std::string>& files, GstClockTime length,
                 std::vector<std::string>* early_ends) {
  Frames frames;
  GstClockTime begin = 0;
  for (const std::string& file : files) {
    FrameIndex index = index_of(file, length);
    if (!index.early_end.empty()) early_ends->push_back(index.early_end);
    if (index.times.empty()) return {{}, 0, false};
    frames.exact &= index.exact;
    const GstClockTime end = begin + index.times.back() + length;
    const auto count = static_cast<int64_t>(index.times.size());
    frames.files.push_back({std::exchange(begin, end),
                            std::exchange(frames.count, frames.count + count),
                            std::move(index.times)});
  }
  return frames;
}

// Pictures are shown one after another.
Frames frames_of_pictures(size_t count, double rate) {
  Frames frames;
  for (size_t i = 0; i < count; ++i)
    frames.files.push_back(
        {0,
         static_cast<int64_t>(i),
         {static_cast<GstClockTime>(std::llround(static_cast<double>(i) * GST_SECOND / rate))}});
  frames.count = static_cast<int64_t>(count);
  return frames;
}

// Some packets are no frames, and some frames have other times than their packets.
bool are_decoded_so(const PlanOptions& options, const std::vector<GstClockTime>& times) {
  FrameReader reader(options.recordings, options.rate);
  reader.begin_at({0, 0, GST_CLOCK_TIME_NONE, true});
  for (size_t i = 0; i < std::min(kChecked, times.size()); ++i)
    if (!reader.next() || reader.time() != times[i]) return false;
  return true;
}

int64_t whole_windows(int64_t frames, int64_t window) {
  return std::max<int64_t>((frames + window - 1) / window, 0) * window;
}

// Of stretches, in frames.
struct Sizes {
  int64_t first, others;
};

// Where each process has one stretch, they end at about the same time: the first one needs no
// warming up, and is longer.
Sizes sizes_of(const PlanOptions& options, int64_t count, int64_t warm_up) {
  const auto whole = [&](int64_t size) {
    return std::max<int64_t>(whole_windows(size, options.window), options.window);
  };
  if (options.stretch > 0) return {whole(options.stretch), whole(options.stretch)};
  const int64_t most = whole(kMostStretch * std::max<int64_t>(warm_up, 4 * options.window));
  if (options.processes == 1 || count > options.processes * most) return {most, most};
  const int64_t others = whole((count - warm_up / kOfWarmUp) / options.processes);
  return {whole(count - (options.processes - 1) * others), others};
}

}  // namespace

Plan make_plan(const PlanOptions& options) {
  Plan plan;
  FrameReader reader(options.recordings, options.rate);
  const bool pictures = reader.pictures();
  if (!reader.next()) throw std::runtime_error("the recording has no frame");
  const GstVideoInfo info = reader.info();
  const CapsPtr caps(gst_video_info_to_caps(&info));
  plan.caps = CharsPtr(gst_caps_to_string(caps.get())).get();

  Frames frames = pictures ? frames_of_pictures(reader.files().size(), options.rate)
                           : frames_of(reader.files(), length_of(info), &plan.early_ends);
  if (frames.exact && !pictures) frames.exact = are_decoded_so(options, frames.files[0].times);
  plan.by_time = frames.exact;
  plan.frames = frames.count;

  const int64_t warm_up = whole_windows(
      options.warm_up < 0 ? int64_t{kWarmUpWindows} * options.window : options.warm_up,
      options.window);
  const int64_t turn = std::lcm<int64_t>(options.window, kTurn);
  const Sizes sizes = sizes_of(options, frames.count, warm_up);
  int64_t first = 0;
  do {
    const int64_t size = first == 0 ? sizes.first : sizes.others;
    Stretch stretch;
    stretch.first = first;
    stretch.frames = frames.count > 0 ? std::min(size, frames.count - first) : 0;
    stretch.warm_up = std::min(first, warm_up);
    // So many frames as they are: those that somebody named.
    if (options.warm_up < 0) stretch.warm_up += (first - stretch.warm_up) % turn;
    if (plan.by_time) {
      std::tie(stretch.place, stretch.warm_up_time) = frames.find(first - stretch.warm_up);
      stretch.first_time = frames.find(first).second;
      if (first + size < frames.count) stretch.end_time = frames.find(first + size).second;
    }
    plan.stretches.push_back(stretch);
    first += size;
  } while (first < frames.count);
  return plan;
}

std::string text_of(const Plan& plan) {
  Json stretches = Json::array();
  for (const Stretch& s : plan.stretches)
    stretches.push_back({s.first, s.frames, s.warm_up, s.place.file, s.place.begin, s.place.seek,
                         s.warm_up_time, s.first_time, s.end_time});
  return Json{{"settings", plan.settings}, {"job", plan.job},
              {"caps", plan.caps},         {"by-time", plan.by_time},
              {"joined", plan.joined},     {"frames", plan.frames},
              {"stretches", stretches},    {"early-ends", plan.early_ends}}
             .dump(1) +
         "\n";
}

Plan plan_of(const std::string& text) {
  const Json json = Json::parse(text);
  Plan plan{json.at("settings"),
            json.at("job"),
            json.at("caps"),
            json.at("by-time"),
            json.at("joined"),
            json.at("frames"),
            {},
            json.at("early-ends")};
  for (const Json& s : json.at("stretches"))
    plan.stretches.push_back({s.at(0),
                              s.at(1),
                              s.at(2),
                              {s.at(3), s.at(4), s.at(5), plan.by_time},
                              s.at(6),
                              s.at(7),
                              s.at(8)});
  return plan;
}

GstVideoInfo info_of(const std::string& text) {
  const CapsPtr caps(gst_caps_from_string(text.c_str()));
  GstVideoInfo info;
  if (!caps || !gst_video_info_from_caps(&info, caps.get()))
    throw std::runtime_error("no frames are like " + text);
  return info;
}

}  // namespace qdmd::archive
