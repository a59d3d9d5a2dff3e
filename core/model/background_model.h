// SPDX-License-Identifier: LGPL-2.1-or-later
// The pictures of a solved window: evaluates L(t) at pixels.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/channels.h"
#include "core/base/large_vector.h"
#include "core/dmd/temporal_model.h"
#include "core/parallel/pool.h"
#include "core/passes/combine.h"
#include "core/passes/rgb_colours.h"
#include "core/planes/owned_picture.h"
#include "core/planes/snapshot_range.h"

namespace qdmd {

// L(t) of one solved window. A few modes are kept as K pictures; a frame then costs 3 K products
// per pixel. The pictures of many modes would take more memory than the window itself: the window's
// frames are then combined directly, at 9 m products per pixel.
class BackgroundModel {
 public:
  // Bits of the frames' samples, 8 to 16: L is in levels of the highest eight all the same, and
  // evaluate_deep() knows more of it. Before all other calls.
  void set_depth(int bits) { depth_ = bits; }
  int depth() const { return depth_; }

  // What the samples are, and what light may make of them. Before all other calls.
  void set_samples(const RgbColours& rgb, const SampleRange& range) {
    rgb_ = rgb;
    range_ = range;
  }

  // All of begin() and build_slice(). `snapshots` is read here and, while the combination is
  // direct, until the next build.
  void build(const SnapshotRange& snapshots, const TemporalModel& model);
  // build() in pieces: begin(), then build_slice() for slices that cover each pixel once, by any
  // thread, in any order. Slices start at multiples of kSliceUnit pixels.
  // keep_pictures: never combine directly.
  void begin(const SnapshotRange& snapshots, const TemporalModel& model,
             bool keep_pictures = false);
  void build_slice(size_t first, size_t count);
  static constexpr size_t kSliceUnit = 64;
  // begin() for build_from(): pictures of modes are made of samples that the caller has, which
  // stand for so many snapshots. They are never combined directly.
  void begin_from(int snapshots, size_t pixels, const TemporalModel& model);
  // A slice of these pictures: planes[j] begins with pixel `first` and can be read up to the next
  // multiple of 64 samples.
  void build_from(const uint8_t* const* planes, size_t first, size_t count);
  // build_from() with whole samples, in units of their lowest bit.
  void build_from(const uint16_t* const* planes, size_t first, size_t count);
  // The snapshots are so many frames apart: 1, until it is set after begin(). Times are in frames.
  void set_stride(int frames) { stride_ = frames; }
  // Frames of one block of kSteadyFrames share the weights of its middle, if this moves no pixel of
  // L(t) by kSteadyLevels, in units of the samples' lowest bit: L need not be made anew for each of
  // them. Until begin().
  void make_steady() { steady_ = true; }
  static constexpr int kSteadyFrames = 10;
  static constexpr double kSteadyLevels = 0.25;
  // One gain for each frame from the first snapshot on. L(t) is seen in the light of time t,
  // or of the nearest time that has one. Kept until begin().
  void set_gains(const std::vector<Gain>& gains) { gains_ = gains; }
  // For set_time() from now on, in place of the snapshots' gains.
  void set_light(const Gain& gain) { gains_.assign(1, gain); }
  // The gain at time t.
  Gain light(double t) const;
  // That of the time that is set.
  const Gain& shown_light() const { return shown_light_; }

  // Room for one limit for each pixel, in levels: the pixel is foreground if its residual exceeds
  // the limit and no threshold is set. Kept until begin().
  uint8_t* make_limits() {
    limits_.resize(pixels_);
    return limits_.data();
  }
  // Null: there are none.
  const uint8_t* limits() const { return limits_.empty() ? nullptr : limits_.data(); }

  // The bytes that a model of a window of `snapshots` takes with up to so many pictures of modes,
  // without limits.
  static uint64_t bytes(size_t pixels, int snapshots, int pictures, bool keep_pictures,
                        int depth = 8);

  // True where so many pictures of modes would take more memory than their window.
  static bool may_combine_directly(int pictures, int snapshots) {
    return static_cast<size_t>(pictures) * sizeof(float) >
           static_cast<size_t>(kChannels) * static_cast<size_t>(snapshots);
  }
  // The most modes whose pictures take no more memory than a window of `snapshots`.
  static int most_modes(int snapshots) { return std::max(1, snapshots / 8); }

  // True if L(t) is a number at every pixel and any t: all numbers that make it up are finite.
  bool is_finite() const;

  // True while the snapshots are still read.
  bool reads_snapshots() const { return direct_ && !frozen_; }
  // From now on L(t) is this L for every t, times what set_light() may say, and the snapshots are
  // no longer needed.
  void freeze_at(double t);
  // freeze_at(), but the light is at each time what it was.
  void freeze_but_for_light(double t);
  // freeze_at(), with a picture of `pixels` pixels that no window made, and limits or null. Throws
  // only where make_room() was not called before.
  void freeze_as(const OwnedPicture& picture, const std::vector<uint8_t>* limits, size_t pixels);
  // Where it throws, all is as it was.
  void make_room(size_t pixels, bool limits);

  // Only while frozen: sets pixels first .. first + count - 1 of L to these levels, in unit light.
  template <typename Level>
  void replace(size_t first, size_t count, const Level* const level[3]) {
    for (size_t c = 0; c < kChannels; ++c) std::copy_n(level[c], count, pictures_[c] + first);
    change();
  }

  // Sets the time of the following calls, in frames from the solved window's first snapshot.
  void set_time(double t);
  // As long as this is the same, L is, at all pixels; no two models' are the same.
  uint64_t picture() const { return picture_; }
  // L at pixels first .. first + count - 1, rounded to 8 bits and clamped to 0 .. 255, into one
  // array a channel. count <= kMaxRun. If samples have more bits: their highest eight, as frames
  // have them.
  void evaluate(size_t first, size_t count, uint8_t* const out[3]) const;
  // L in units of the lowest bit, rounded.
  void evaluate_deep(size_t first, size_t count, uint16_t* const out[3]) const;
  // L in all bits, as frames are kept. If there are more than eight, the highest need not be those
  // of evaluate(), which does not round up to them.
  void evaluate(size_t first, size_t count, const MutableSamples out[3]) const;
  // The same of all `pixels` pixels. pool may be null.
  void evaluate_all(size_t pixels, const MutableSamples out[3], Pool* pool) const;

 private:
  size_t picture_count() const { return pictures_.size(); }
  // L before rounding, at a `first` that is a multiple of kSliceUnit, where the combination is
  // direct.
  void combine_directly(size_t first, size_t count, float* const* out) const;
  template <typename T>
  void combine_runs(const T* const* planes, size_t plane_count, size_t from, size_t first,
                    size_t count);
  template <typename Evaluate>
  void evaluate_with(size_t first, const Evaluate& evaluate, size_t count) const;
  void begin_with(const TemporalModel& model, int snapshots, bool direct);
  void make_pictures(size_t count);
  void group(const Eigen::MatrixXd& rows);
  void take_weights(const float* weights, size_t count);
  void take_light(double t);
  template <typename Sample>
  void evaluate_ends(size_t first, size_t count, float scale, float bias,
                     Sample* const out[3]) const;
  void use_steady_weights(double t);
  // L is another picture from now on.
  void change();

  TemporalModel model_;
  Eigen::MatrixXd basis_, time_weights_, direct_weights_;
  Gain shown_light_ = kSameLight;
  Eigen::MatrixXd steady_weights_;
  std::vector<float> single_weights_;  // of one time, as weights_
  Eigen::VectorXd largest_;            // that a picture has at a pixel, in levels: bounds
  bool direct_ = false, frozen_ = false, steady_ = false;
  uint64_t picture_ = 0;
  int stride_ = 1, depth_ = 8;
  size_t snapshot_planes_ = 0;  // channels of all snapshots
  size_t pixels_ = 0;
  // The snapshots' highest eight bits, in time order, and then the bits below them.
  std::vector<const uint8_t*> planes_;
  // The pictures' or, where direct_, those of L(t): what combine_planes() is given.
  std::vector<double> coefficients_;
  LargeVector<float> samples_;  // of the pictures, one after another
  std::vector<float*> pictures_;
  std::vector<float> weights_;  // 3 x K over pictures
  std::vector<Gain> gains_;     // of the snapshots; none: the same light
  RgbColours rgb_;
  SampleRange range_;
  Offset offset_ = {};  // what light adds
  // In more light R, G and B end, but not the samples that are made of them.
  bool ends_ = false;
  std::vector<uint8_t> limits_;
};

}  // namespace qdmd
