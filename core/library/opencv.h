// SPDX-License-Identifier: LGPL-2.1-or-later
// The engine with the interface of OpenCV's background subtractors. Needs OpenCV's headers.
#pragma once

#include <exception>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/version.hpp>
#include <opencv2/video/background_segm.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "separator.h"

// From some version on cv::BackgroundSubtractor asks for apply() with a known foreground. The word
// `override` is an error before that, and without it compilers may warn.
#if CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 14
#define QDMD_OVERRIDES_KNOWN_FOREGROUND override
#else
#define QDMD_OVERRIDES_KNOWN_FOREGROUND
#endif

namespace qdmd::library {

namespace internal {

// No other exception than OpenCV's gets past this.
template <typename Action>
auto guarded(Action action) {
  try {
    return action();
  } catch (const cv::Exception&) {
    throw;
  } catch (const std::bad_alloc&) {
    CV_Error(cv::Error::StsNoMem, "not enough memory for the window: lower window_size");
  } catch (const std::exception& error) {
    CV_Error(cv::Error::StsBadArg, error.what());
  }
}

}  // namespace internal

// In place of cv::createBackgroundSubtractorMOG2(). Frames are CV_8UC1 (grey), CV_8UC3 (BGR),
// CV_32FC1 or CV_32FC3 (levels 0 to 255, rounded to whole ones), or CV_16UC1 and CV_16UC3, which
// MOG2 refuses. What is refused throws cv::Exception, and nothing has changed. docs/library.md
// lists what differs from MOG2.
class BackgroundSubtractor : public cv::BackgroundSubtractor {
 public:
  // Options::mode is Mode::live, whatever it says.
  explicit BackgroundSubtractor(const Options& options = {})
      : options_(live(options)),
        separator_(internal::guarded([&] { return Separator(options_); })) {}

  // learning_rate: 0 keeps the background as it is; 1 or more begins anew with this frame; every
  // other one means what the options say.
  void apply(cv::InputArray image, cv::OutputArray mask, double learning_rate = -1) override {
    apply_frame(image.getMat(), cv::Mat(), mask, learning_rate);
  }

  // known: CV_8UC1 of the frame's size, or empty. Where it is not 0 the mask is 255, and nothing is
  // learnt.
  virtual void apply(cv::InputArray image, cv::InputArray known, cv::OutputArray mask,
                     double learning_rate = -1) QDMD_OVERRIDES_KNOWN_FOREGROUND {
    apply_frame(image.getMat(), known.getMat(), mask, learning_rate);
  }

  // Of the frames' type. Empty where no frame was applied yet.
  void getBackgroundImage(cv::OutputArray background) const override {
    const cv::Mat picture = picture_of_background();
    if (picture.empty())
      background.release();
    else
      picture.convertTo(background, type_ < 0 ? picture.depth() : CV_MAT_DEPTH(type_));
  }

  // The options and what was learnt; read() goes on from there.
  void write(cv::FileStorage& file) const override {
    file << "name" << kName;
    Options options = options_;
    each_number(&options, [&](const char* name, auto* value) {
      using Value = std::remove_pointer_t<decltype(value)>;
      if constexpr (std::is_floating_point_v<Value>)
        file << name << static_cast<double>(*value);
      else if constexpr (kIsLong<Value>)
        file << name << std::to_string(*value);
      else
        file << name << static_cast<int>(*value);
    });
    file << "ignore"
         << "[";
    for (const Rectangle& area : options.ignore)
      file << area.x << area.y << area.width << area.height;
    file << "]";
    auto bytes = internal::guarded([&] { return separator_.save(); });
    if (!bytes.empty())
      file << "learnt" << cv::Mat(1, static_cast<int>(bytes.size()), CV_8UC1, bytes.data());
  }
  void read(const cv::FileNode& node) override {
    CV_Assert(static_cast<std::string>(node["name"]) == kName);
    Options options;
    each_number(&options, [&](const char* name, auto* value) {
      using Value = std::remove_pointer_t<decltype(value)>;
      const cv::FileNode number = node[name];
      if constexpr (kIsLong<Value>) {
        if (number.isString()) {
          *value = internal::guarded([&] { return std::stoull(static_cast<std::string>(number)); });
          return;
        }
      }
      if (!number.empty()) *value = static_cast<Value>(static_cast<double>(number));
    });
    std::vector<int> sides;
    if (!node["ignore"].empty()) node["ignore"] >> sides;
    CV_Assert(sides.size() % 4 == 0);
    for (size_t i = 0; i < sides.size(); i += 4)
      options.ignore.push_back({sides[i], sides[i + 1], sides[i + 2], sides[i + 3]});
    cv::Mat bytes;
    if (!node["learnt"].empty()) node["learnt"] >> bytes;
    CV_Assert(bytes.empty() || (bytes.type() == CV_8UC1 && bytes.isContinuous()));
    Separator separator = internal::guarded([&] {
      Separator made(options);
      if (!bytes.empty()) made.load(bytes.data, bytes.total());
      return made;
    });
    separator_ = std::move(separator);
    options_ = options;
    type_ = -1;
  }
  cv::String getDefaultName() const override { return kName; }

 private:
  static constexpr const char* kName = "BackgroundSubtractor_QDMD";

  // FileStorage has no whole numbers of 64 bits, and OpenCV 4.10 reads large real ones without a
  // fraction as 32 bits: they are kept as text.
  template <typename Value>
  static constexpr bool kIsLong = std::is_integral_v<Value> && sizeof(Value) > sizeof(int);

  static Options live(Options options) {
    options.mode = Mode::live;
    return options;
  }

  // Calls see(name, pointer) of each option that is a number.
  template <typename See>
  static void each_number(Options* options, See see) {
    see("method", &options->method);
    see("window_size", &options->window_size);
    see("hop_size", &options->hop_size);
    see("rank", &options->rank);
    see("omega_threshold", &options->omega_threshold);
    see("amplitude", &options->amplitude);
    see("solver", &options->solver);
    see("estimator", &options->estimator);
    see("sample_step", &options->sample_step);
    see("iterations", &options->iterations);
    see("stabilize", &options->stabilize);
    see("stabilize_output", &options->stabilize_output);
    see("foreground_threshold", &options->foreground_threshold);
    see("shadows", &options->shadows);
    see("mask_softness", &options->mask_softness);
    see("absorb_frames", &options->absorb_frames);
    see("frame_rate", &options->frame_rate);
    see("time_budget", &options->time_budget);
    see("mask_scale", &options->mask_scale);
    see("threads", &options->threads);
    see("max_memory", &options->max_memory);
  }

  static Layout layout(const cv::Mat& picture) {
    return {picture.cols, picture.rows, static_cast<ptrdiff_t>(picture.step),
            picture.channels() == 1 ? Pixels::grey : Pixels::bgr,
            picture.depth() == CV_16U ? 16 : 8};
  }

  cv::Mat picture_of_background() const {
    return internal::guarded([&] {
      const Layout frames = separator_.frames();
      cv::Mat picture;
      if (frames.width == 0) return picture;
      picture.create(
          frames.height, frames.width,
          CV_MAKETYPE(frames.depth > 8 ? CV_16U : CV_8U, frames.pixels == Pixels::grey ? 1 : 3));
      if (!separator_.background(layout(picture), picture.data)) picture.release();
      return picture;
    });
  }

  void apply_frame(cv::Mat frame, const cv::Mat& known, cv::OutputArray mask,
                   double learning_rate) {
    const int type = frame.type();
    CV_Assert(type == CV_8UC1 || type == CV_8UC3 || type == CV_32FC1 || type == CV_32FC3 ||
              type == CV_16UC1 || type == CV_16UC3);
    CV_Assert(!frame.empty());
    CV_Assert(known.empty() || (known.type() == CV_8UC1 && known.size() == frame.size()));
    if (frame.depth() == CV_32F) frame.convertTo(frame, CV_8U);
    internal::guarded([&] {
      if (learning_rate >= 1 || (type_ >= 0 && type != type_)) separator_.reset();
      separator_.freeze(learning_rate == 0);
      if (!known.empty()) {
        const cv::Mat background = picture_of_background();
        frame = frame.clone();
        if (background.type() == frame.type() && background.size() == frame.size())
          background.copyTo(frame, known);
      }
      separator_.push(frame.data, layout(frame));
      type_ = type;
      try {
        mask.create(frame.size(), CV_8UC1);
        cv::Mat out = mask.getMat();
        separator_.write(Output::mask, layout(out), out.data);
        if (!known.empty()) out.setTo(255, known);
      } catch (...) {
        if (separator_.ready()) separator_.skip();
        throw;
      }
      separator_.skip();
    });
  }

  Options options_;
  mutable Separator separator_;  // waits for the solve that is under way
  int type_ = -1;                // of the frames; -1: none was applied
};

inline cv::Ptr<cv::BackgroundSubtractor> create_background_subtractor(const Options& options = {}) {
  return cv::makePtr<BackgroundSubtractor>(options);
}

}  // namespace qdmd::library

#undef QDMD_OVERRIDES_KNOWN_FOREGROUND
