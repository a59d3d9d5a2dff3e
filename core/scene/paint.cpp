// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/paint.h"

#include <cmath>
#include <cstring>

#include "core/scene/scene.h"

namespace qdmd::scene {
namespace {

template <int kSamples, unsigned kRound>
void crop_raster(const Raster<kSamples>& canvas, double left, double top, Raster<kSamples>* frame) {
  // In 1/256 pixel: the four weights are integers that add up to 65536.
  const auto x = static_cast<int>(std::lround(left * 256));
  const auto y = static_cast<int>(std::lround(top * 256));
  const int x0 = std::clamp(x >> 8, 0, canvas.width - frame->width);
  const int y0 = std::clamp(y >> 8, 0, canvas.height - frame->height);
  const auto right_share = static_cast<unsigned>(x & 255),
             lower_share = static_cast<unsigned>(y & 255);
  const int x1 = std::min(x0 + 1, canvas.width - frame->width);
  const int y1 = std::min(y0 + 1, canvas.height - frame->height);
  const unsigned w00 = (256 - right_share) * (256 - lower_share);
  const unsigned w01 = right_share * (256 - lower_share);
  const unsigned w10 = (256 - right_share) * lower_share, w11 = right_share * lower_share;
  const size_t bytes = frame->row_bytes();
  for (int row = 0; row < frame->height; ++row) {
    const uint8_t *a = canvas.at(x0, y0 + row), *b = canvas.at(x1, y0 + row);
    const uint8_t *c = canvas.at(x0, y1 + row), *d = canvas.at(x1, y1 + row);
    uint8_t* out = frame->row(row);
    if (right_share == 0 && lower_share == 0) {
      std::memcpy(out, a, bytes);
      continue;
    }
    for (size_t i = 0; i < bytes; ++i)
      out[i] =
          static_cast<uint8_t>((w00 * a[i] + w01 * b[i] + w10 * c[i] + w11 * d[i] + kRound) >> 16);
  }
}

template <int kSamples, unsigned kRound>
void crop_turned_raster(const Raster<kSamples>& canvas, double left, double top, double turn,
                        Raster<kSamples>* frame) {
  const double middle_x = (frame->width - 1) / 2.0, middle_y = (frame->height - 1) / 2.0;
  const double cosine = std::cos(turn), sine = std::sin(turn);
  for (int row = 0; row < frame->height; ++row)
    for (int col = 0; col < frame->width; ++col) {
      const double u = col - middle_x, v = row - middle_y;
      const double at_x = left + middle_x + cosine * u - sine * v;
      const double at_y = top + middle_y + sine * u + cosine * v;
      const auto x = static_cast<int>(std::lround(std::clamp(at_x, 0.0, canvas.width - 1.0) * 256));
      const auto y =
          static_cast<int>(std::lround(std::clamp(at_y, 0.0, canvas.height - 1.0) * 256));
      const int x0 = x >> 8, y0 = y >> 8;
      const int x1 = std::min(x0 + 1, canvas.width - 1), y1 = std::min(y0 + 1, canvas.height - 1);
      const auto right = static_cast<unsigned>(x & 255), lower = static_cast<unsigned>(y & 255);
      const uint8_t *a = canvas.at(x0, y0), *b = canvas.at(x1, y0);
      const uint8_t *c = canvas.at(x0, y1), *d = canvas.at(x1, y1);
      uint8_t* out = frame->at(col, row);
      for (int i = 0; i < kSamples; ++i)
        out[i] = static_cast<uint8_t>(((256 - right) * (256 - lower) * a[i] +
                                       right * (256 - lower) * b[i] + (256 - right) * lower * c[i] +
                                       right * lower * d[i] + kRound) >>
                                      16);
    }
}

using Curve = std::array<uint8_t, 256>;

// What a camera's curve makes of a factor of the light: levels become `factor` times what they are,
// and `offset` more.
struct LevelChange {
  double factor, offset;
};

LevelChange change_of(double gain, double gamma) {
  if (gamma == 1) return {gain, 0};
  const double factor = std::pow(gain, 1 / gamma);
  return {factor, black_of_curve(gamma) * (factor - 1)};
}

Curve curve(double gain, double gamma) {
  const LevelChange change = change_of(gain, gamma);
  Curve levels;
  for (size_t i = 0; i < levels.size(); ++i)
    levels[i] = to_level(static_cast<double>(i) * change.factor + change.offset);
  return levels;
}

// The same for all pixels of a row, or of the picture.
void apply_evenly(const Light& light, Picture* picture) {
  std::array<Curve, 3> curves;
  const auto set_curves = [&](double factor) {
    for (size_t c = 0; c < 3; ++c)
      curves[c] = c > 0 && light.gain[c] == light.gain[c - 1]
                      ? curves[c - 1]
                      : curve(light.gain[c] * factor, light.gamma);
  };
  set_curves(1);
  for (int y = 0; y < picture->height; ++y) {
    if (!light.rows.empty()) set_curves(light.rows[static_cast<size_t>(y)]);
    uint8_t* row = picture->row(y);
    for (int x = 0; x < picture->width; ++x, row += 3)
      for (size_t c = 0; c < 3; ++c) row[c] = curves[c][row[c]];
  }
}

void apply_by_pixel(const Light& light, Picture* picture) {
  for (int y = 0; y < picture->height; ++y) {
    const double of_row = light.rows.empty() ? 1 : light.rows[static_cast<size_t>(y)];
    uint8_t* row = picture->row(y);
    for (int x = 0; x < picture->width; ++x, row += 3) {
      double factor = of_row;
      for (const LocalLight& part : light.local) factor *= part.factor(x, y);
      const bool white = light.gain[0] == light.gain[1] && light.gain[0] == light.gain[2];
      LevelChange change{};
      for (size_t c = 0; c < 3; ++c) {
        if (c == 0 || !white) change = change_of(light.gain[c] * factor, light.gamma);
        row[c] = to_level(row[c] * change.factor + change.offset);
      }
    }
  }
}

}  // namespace

void paint_sprite(const Sprite& sprite, int x, int y, Picture* canvas) {
  visit_runs(sprite, x, y, canvas->width, canvas->height,
             [&](int row, int left, int length, const Sprite::Run& run, int skipped) {
               std::memcpy(canvas->at(left, row), sprite.picture.at(run.x + skipped, run.y),
                           static_cast<size_t>(length) * Picture::kSamplesPerPixel);
             });
}

void paint_coverage(const Sprite& sprite, int x, int y, uint8_t coverage, Plane* canvas) {
  visit_runs(sprite, x, y, canvas->width, canvas->height,
             [&](int row, int left, int length, const Sprite::Run&, int) {
               std::memset(canvas->at(left, row), coverage, static_cast<size_t>(length));
             });
}

void crop(const Picture& canvas, double left, double top, Picture* frame) {
  crop_raster<3, 32768>(canvas, left, top, frame);
}

void crop(const Plane& canvas, double left, double top, Plane* frame) {
  crop_raster<1, 65535>(canvas, left, top, frame);
}

void crop_turned(const Picture& canvas, double left, double top, double turn, Picture* frame) {
  crop_turned_raster<3, 32768>(canvas, left, top, turn, frame);
}

void crop_turned(const Plane& canvas, double left, double top, double turn, Plane* frame) {
  crop_turned_raster<1, 65535>(canvas, left, top, turn, frame);
}

void apply(const Light& light, Picture* picture) {
  if (light.local.empty())
    apply_evenly(light, picture);
  else
    apply_by_pixel(light, picture);
  if (light.grey > 0) take_colour(light.grey, picture);
}

void take_colour(double brightness, Picture* picture) {
  uint8_t* end = picture->samples.data() + picture->samples.size();
  for (uint8_t* pixel = picture->samples.data(); pixel != end; pixel += 3)
    pixel[0] = pixel[1] = pixel[2] =
        to_level((0.299 * pixel[0] + 0.587 * pixel[1] + 0.114 * pixel[2]) * brightness);
}

double mean_local_light(const Light& light, int width, int height) {
  constexpr int kPlaces = 16;
  double sum = 0;
  for (int y = 0; y < kPlaces; ++y)
    for (int x = 0; x < kPlaces; ++x) {
      double factor = 1;
      for (const LocalLight& part : light.local)
        factor *= part.factor((x + 0.5) * width / kPlaces, (y + 0.5) * height / kPlaces);
      sum += factor;
    }
  return sum / (kPlaces * kPlaces);
}

void to_labels(const Plane& shadow, Plane* coverage) {
  uint8_t* label = coverage->samples.data();
  const uint8_t* dark = shadow.samples.empty() ? nullptr : shadow.samples.data();
  for (size_t i = 0; i < coverage->samples.size(); ++i) {
    const uint8_t beneath = dark && dark[i] ? kShadowLabel : kBackgroundLabel;
    label[i] = label[i] >= 128 ? kObjectLabel : label[i] > 0 ? kPartLabel : beneath;
  }
}

}  // namespace qdmd::scene
