#include "core/scene/effects/infos.h"

#include <cmath>

namespace qdmd::scene {
namespace {

// Running sums of a row or a column of `length` values `step` apart: the mean of 2 radius + 1
// neighbours, rounded to the nearest or up; the ends are repeated.
void box_filter(uint8_t* values, ptrdiff_t step, int length, int radius, bool round_up,
                std::vector<uint8_t>* line) {
  line->resize(static_cast<size_t>(length));
  for (int i = 0; i < length; ++i) (*line)[static_cast<size_t>(i)] = values[i * step];
  const auto at = [&](int i) {
    return static_cast<int>((*line)[static_cast<size_t>(std::clamp(i, 0, length - 1))]);
  };
  const int width = 2 * radius + 1, round = round_up ? width - 1 : radius;
  int sum = 0;
  for (int i = -radius; i < radius; ++i) sum += at(i);
  for (int i = 0; i < length; ++i) {
    sum += at(i + radius);
    values[i * step] = static_cast<uint8_t>((sum + round) / width);
    sum -= at(i - radius);
  }
}

class Defocus : public Effect {
 public:
  Defocus(Values values, const StreamSource&) {
    // Three boxes of 2 r + 1 pixels have a variance of r^2 + r: take the radii that together come
    // nearest to the one wanted.
    const double wanted = values[0] * values[0];
    double best = 1e300;
    const int largest = static_cast<int>(values[0]) + 1;
    for (int r = 0; r <= largest; ++r)
      for (int wider = 0; wider <= 3; ++wider) {
        const double variance = ((3 - wider) * (r * r + r) + wider * (r + 1) * (r + 2)) / 3.0;
        if (std::abs(variance - wanted) >= best) continue;
        best = std::abs(variance - wanted);
        for (int i = 0; i < 3; ++i) radii_[static_cast<size_t>(i)] = r + (i < wider ? 1 : 0);
      }
  }

  int margin() const override { return radii_[0] + radii_[1] + radii_[2]; }

  void lens(FrameState& state) override {
    if (state.wants(kFrame)) blur(&state.picture, false);
    if (state.wants(kTruth)) blur(&state.truth, false);
    // A pixel to which an object gives any light is not background.
    if (!state.wants(kLabels)) return;
    blur(&state.coverage, true);
    if (!state.shadow.samples.empty()) blur(&state.shadow, true);
  }

 private:
  template <int kSamples>
  void blur(Raster<kSamples>* raster, bool round_up) {
    for (const int radius : radii_) {
      if (radius == 0) continue;
      for (int y = 0; y < raster->height; ++y)
        for (int c = 0; c < kSamples; ++c)
          box_filter(raster->row(y) + c, kSamples, raster->width, radius, round_up, &line_);
      blur_columns(raster, radius, round_up);
    }
  }

  // Row by row, with one running sum for each column.
  template <int kSamples>
  void blur_columns(Raster<kSamples>* raster, int radius, bool round_up) {
    const int height = raster->height, width = 2 * radius + 1,
              round = round_up ? width - 1 : radius;
    const size_t bytes = raster->row_bytes();
    source_ = raster->samples;
    sums_.assign(bytes, 0);
    const auto row = [&](int y) {
      return source_.data() + static_cast<size_t>(std::clamp(y, 0, height - 1)) * bytes;
    };
    for (int y = -radius; y < radius; ++y)
      for (size_t i = 0; i < bytes; ++i) sums_[i] += row(y)[i];
    for (int y = 0; y < height; ++y) {
      const uint8_t *in = row(y + radius), *out = row(y - radius);
      uint8_t* mean = raster->row(y);
      for (size_t i = 0; i < bytes; ++i) {
        sums_[i] += in[i];
        mean[i] = static_cast<uint8_t>((sums_[i] + round) / width);
        sums_[i] -= out[i];
      }
    }
  }

  std::array<int, 3> radii_{};
  std::vector<uint8_t> line_, source_;
  std::vector<int> sums_;
};

constexpr Parameter kParameters[] = {
    {"deviation", "px", 1.5, 0, 30,
     "standard deviation of the blur, which is three box filters in a row"},
};

}  // namespace

const EffectInfo kDefocus = {
    "defocus",   "a lens out of focus: everything is blurred, the true background too",
    kLens,       kWarp | kBuffers,
    kParameters, make_effect<Defocus>};

}  // namespace qdmd::scene
