// The pictures of a solved window: evaluates L(t) at pixels.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/channels.h"
#include "core/base/large_vector.h"
#include "core/dmd/temporal_model.h"
#include "core/gram/window.h"
#include "core/passes/combine.h"

namespace qdmd {

// L(t) of one solved window. A few modes are kept as K pictures; a frame then costs 3 K products
// per pixel. The pictures of many modes would take more memory than the window itself: the window's
// frames are then combined directly, at 9 m products per pixel.
class BackgroundModel {
 public:
  // Of samples with so many bits below their highest eight (SnapshotRange::with_low), 0 to 8: L is
  // in levels of the highest eight all the same, and evaluate_deep() knows more of it. Before all
  // others.
  void set_low_bits(int bits) { low_bits_ = bits; }
  int low_bits() const { return low_bits_; }

  // All of begin() and build_slice(). `snapshots` is read here and, while the combination is
  // direct, until the next build.
  void build(const SnapshotRange& snapshots, const TemporalModel& model);
  // The same in pieces: begin(), then build_slice() for slices that cover each pixel once, by any
  // thread, in any order. Slices start at multiples of kSliceUnit pixels.
  // keep_pictures: never combine directly.
  void begin(const SnapshotRange& snapshots, const TemporalModel& model,
             bool keep_pictures = false);
  void build_slice(size_t first, size_t count);
  static constexpr size_t kSliceUnit = 64;
  // A slice from other samples than the snapshots': planes[j] begins with pixel `first` and can be
  // read up to the next multiple of 64 samples. Not where the combination is direct.
  void build_from(const uint8_t* const* planes, size_t first, size_t count);
  // The same of whole samples, in units of their lowest bit.
  void build_from(const uint16_t* const* planes, size_t first, size_t count);
  // The snapshots are so many frames apart: 1, until it is set after begin(). Times are in frames.
  void set_stride(int frames) { stride_ = frames; }
  // Frames of one block of kSteadyFrames share the weights of its middle, if this moves no pixel of
  // L(t) by kSteadyLevels, in units of the samples' lowest bit: L need not be made anew for each of
  // them. Until begin().
  void make_steady() { steady_ = true; }
  static constexpr int kSteadyFrames = 10;
  static constexpr double kSteadyLevels = 0.25;
  // One gain for each frame from the first snapshot on. L(t) is multiplied by the gain of time t,
  // or of the nearest time that has one. Kept until begin().
  void set_gains(const std::vector<Gain>& gains) { gains_ = gains; }
  // For set_time() from now on, in place of the snapshots' gains.
  void set_light(const Gain& gain) { gains_.assign(1, gain); }
  // The gain at time t.
  Gain light(double t) const;

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
                        bool deep = false);

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
  // The same, but the light is at each time what it was.
  void freeze_but_for_light(double t);
  // The same with a picture that no window made: planes of `pixels` samples, and limits or null.
  // low: so many bits below the picture's samples, or 0 bits and empty planes. Throws only where
  // make_room() was not called before.
  void freeze_as(const std::vector<uint8_t> level[kChannels],
                 const std::vector<uint8_t> low[kChannels], int low_bits,
                 const std::vector<uint8_t>* limits, size_t pixels);
  void freeze_as(const std::vector<uint8_t> level[kChannels], const std::vector<uint8_t>* limits,
                 size_t pixels) {
    const std::vector<uint8_t> none[kChannels];
    freeze_as(level, none, 0, limits, pixels);
  }
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
  // array a channel. count <= kMaxRun. Of samples with low bits its high digit, as frames have it.
  void evaluate(size_t first, size_t count, uint8_t* const out[3]) const;
  // The same in units of the lowest bit, rounded.
  void evaluate_deep(size_t first, size_t count, uint16_t* const out[3]) const;
  // These as digits. The high ones need not be evaluate()'s, which does not round up to them.
  void evaluate_digits(size_t first, size_t count, uint8_t* const high[3],
                       uint8_t* const low[3]) const;

 private:
  size_t picture_count() const { return pictures_.size(); }
  // The same before rounding, at a `first` that is a multiple of kSliceUnit, where the combination
  // is direct.
  void combine_directly(size_t first, size_t count, float* const* out) const;
  template <typename T>
  void combine_runs(const T* const* planes, size_t plane_count, size_t from, size_t first,
                    size_t count);
  template <typename Evaluate>
  void evaluate_with(size_t first, const Evaluate& evaluate, size_t count) const;
  void make_pictures(size_t count);
  void group(const Eigen::MatrixXd& rows);
  void take_weights(const float* weights, size_t count);
  void use_steady_weights(double t);
  // L is another picture from now on.
  void change();

  TemporalModel model_;
  Eigen::MatrixXd basis_, time_weights_, direct_weights_;
  Eigen::MatrixXd steady_weights_;
  std::vector<float> single_weights_;  // of one time, as weights_
  Eigen::VectorXd largest_;            // that a picture has at a pixel, in levels: bounds
  bool direct_ = false, frozen_ = false, steady_ = false;
  uint64_t picture_ = 0;
  int stride_ = 1, low_bits_ = 0;
  size_t snapshot_planes_ = 0;  // channels of all snapshots, without low digits
  size_t pixels_ = 0;
  // Of the snapshots, in time order; and then their low digits.
  std::vector<const uint8_t*> planes_;
  std::vector<double>
      coefficients_;            // of the pictures, or of L(t) where direct_, for combine_planes
  LargeVector<float> samples_;  // of the pictures, one after another
  std::vector<float*> pictures_;
  std::vector<float> weights_;  // 3 x K over pictures
  std::vector<Gain> gains_;     // of the snapshots; none: the same light
  std::vector<uint8_t> limits_;
};

}  // namespace qdmd
