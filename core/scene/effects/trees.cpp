// SPDX-License-Identifier: LGPL-2.1-or-later
// Trees near the camera, whose boughs sway before whatever is behind them.
#include "core/scene/effects/infos.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace qdmd::scene {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

// Where boughs hang: all that is nearer to the left edge than a limit, which leaves them their
// share of the frame. Coordinates are shares of the frame.
class Crown {
 public:
  Crown(double share, Stream& stream) {
    for (double& phase : phases_) phase = kTurn * stream.uniform();
    constexpr int kSide = 64;
    std::vector<double> distances;
    for (int i = 0; i < kSide * kSide; ++i)
      distances.push_back(distance((i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide));
    std::sort(distances.begin(), distances.end());
    const auto hidden = static_cast<size_t>(std::lround(share * kSide * kSide));
    constexpr double kEverything = std::numeric_limits<double>::infinity();
    limit_ = hidden == 0                  ? -kEverything
             : hidden == distances.size() ? kEverything
                                          : distances[hidden];
  }

  bool contains(double x, double y) const { return distance(x, y) < limit_; }
  // No bough reaches farther to the right.
  double right() const { return limit_ + 2 * kBump; }

 private:
  static constexpr double kBump = 0.03;

  double distance(double x, double y) const {
    const double bumps = std::sin(9 * y + phases_[0]) + std::sin(23 * y + phases_[1]);
    // Trees are wider above than below.
    return x + kBump * bumps + 0.3 * std::max(0.0, y - 0.45);
  }

  std::array<double, 2> phases_{};
  double limit_ = 0;
};

// How far boughs are bent, in shares of the amplitude: smooth in place and in time.
class Wind {
 public:
  struct Bend {
    float x = 0, y = 0;
  };

  // `unit`: pixels of the picture's size.
  Wind(double frequency, double unit, Stream& stream) {
    // Boughs that swing slowly, and twigs on them.
    for (size_t i = 0; i < waves_.size(); ++i) {
      constexpr std::array kWeights{0.4, 0.3, 0.2, 0.1}, kLengths{0.9, 0.5, 0.3, 0.15};
      const double way = kTurn * stream.uniform(), turns = kTurn / (kLengths[i] * unit);
      waves_[i] = {kWeights[i],
                   frequency * stream.uniform(0.7, 1.4) * (1 + 0.5 * static_cast<double>(i)),
                   turns * std::cos(way),
                   turns * std::sin(way),
                   kTurn * stream.uniform(),
                   kTurn * stream.uniform()};
    }
  }

  Bend at(double x, double y, double time) const {
    double across = 0, down = 0;
    for (const Wave& wave : waves_) {
      const double phase = wave.x * x + wave.y * y - kTurn * wave.frequency * time;
      across += wave.weight * std::sin(phase + wave.phase_x);
      down += wave.weight * std::sin(phase + wave.phase_y) / 2;
    }
    return {static_cast<float>(across), static_cast<float>(down)};
  }

 private:
  struct Wave {
    double weight, frequency, x, y, phase_x, phase_y;
  };
  std::array<Wave, 4> waves_{};
};

// Leaves at rest, on a canvas that reaches beyond the scene's; the fourth sample of a pixel is not
// 0 where there is one.
struct Layer {
  Raster<4> leaves;
  Wind wind;
  double amplitude;
  std::vector<Wind::Bend> bends;  // pixels, at the points of a grid
};

class Trees : public Effect {
 public:
  Trees(Values values, const StreamSource& streams)
      : share_(values[0]), amplitude_(values[1]), frequency_(values[2]), streams_(streams) {}

  void plan(Plan& plan) override {
    width_ = plan.width, height_ = plan.height, margin_ = plan.backdrop->margin();
    const double unit = std::sqrt(static_cast<double>(width_) * height_);
    twig_ = std::max(unit / 20, 2.0);
    reach_ = static_cast<int>(std::ceil(amplitude_)) + 1;
    Stream stream = streams_.at(StreamSource::kSetup);
    const Crown crown(share_, stream);
    const double right = std::ceil(crown.right() * width_ + twig_) + reach_;
    right_ = static_cast<int>(std::clamp(right, 0.0, width_ + 1.0 * margin_)) + margin_;
    before_ = (margin_ + kStep - 1) / kStep;
    columns_ = before_ + (right_ - margin_) / kStep + 2;
    rows_ = before_ + (height_ + margin_) / kStep + 2;
    if (crown.right() <= 0) return;
    for (int depth = 0; depth < kDepths; ++depth) {
      // The near boughs swing farther.
      layers_.push_back(
          {canvas(), Wind(frequency_, unit, stream), amplitude_ * (1 - 0.25 * depth), {}});
      grow(depth, crown, &layers_.back().leaves);
    }
    layers_.push_back({canvas(), Wind(frequency_, unit, stream), 0, {}});
    paint_trunk(&layers_.back().leaves);
  }

  void world(FrameState& state) override {
    for (Layer& layer : layers_) bend(state.time, &layer);
    Sprite& front = state.front;
    front.picture.resize(state.world.width, state.world.height);
    front.runs.clear();
    for (int y = 0; y < state.world.height && !layers_.empty(); ++y)
      for (int x = 0; x < right_; ++x) {
        const uint8_t* leaf = seen_at(x, y);
        if (!leaf) continue;
        std::copy_n(leaf, 3, front.picture.at(x, y));
        if (!front.runs.empty() && front.runs.back().y == y &&
            front.runs.back().x + front.runs.back().length == x)
          ++front.runs.back().length;
        else
          front.runs.push_back({y, x, 1});
      }
  }

 private:
  static constexpr int kDepths = 3;
  // Pixels between the points at which bends are known. They are at fixed places of the frame, so
  // that a larger canvas has no other bends.
  static constexpr int kStep = 8;

  Raster<4> canvas() const { return {right_ + 2 * reach_, height_ + 2 * (margin_ + reach_)}; }

  // Twigs in a grid, each with some leaves or none: clusters and gaps.
  void grow(int depth, const Crown& crown, Raster<4>* leaves) const {
    const int beyond = margin_ + reach_;
    const auto cell = [&](double at) { return static_cast<int>(std::floor(at / twig_)); };
    for (int j = cell(-beyond) - 1; j <= cell(height_ + beyond) + 1; ++j)
      for (int i = cell(-beyond) - 1; i <= cell(right_ - margin_ + reach_) + 1; ++i) {
        constexpr int64_t kCells = 1 << 20;  // more than there are in a row or column
        Stream stream =
            streams_.unlogged(((depth + 1) * kCells + j + kCells / 2) * kCells + i + kCells / 2);
        for (int left = stream.index(9); left > 0; --left) {
          const double x = (i + stream.uniform()) * twig_, y = (j + stream.uniform()) * twig_;
          const double length = twig_ * stream.uniform(0.3, 0.45), way = kTurn * stream.uniform();
          const double bright = stream.uniform(0.6, 1.35) * (1 - 0.2 * depth);
          if (crown.contains(x / width_, y / height_))
            paint_leaf(x + beyond, y + beyond, length, way, bright, leaves);
        }
      }
  }

  static void paint_leaf(double x, double y, double length, double way, double bright,
                         Raster<4>* leaves) {
    const int left = std::max(static_cast<int>(x - length), 0);
    const int top = std::max(static_cast<int>(y - length), 0);
    const int right = std::min(static_cast<int>(x + length) + 1, leaves->width);
    const int bottom = std::min(static_cast<int>(y + length) + 1, leaves->height);
    const double cosine = std::cos(way), sine = std::sin(way);
    for (int v = top; v < bottom; ++v)
      for (int u = left; u < right; ++u) {
        const double dx = u + 0.5 - x, dy = v + 0.5 - y;
        const double along = (dx * cosine + dy * sine) / length;
        const double across = (dy * cosine - dx * sine) / (0.4 * length);
        if (std::abs(across) > 1 - along * along) continue;
        // A leaf is folded along its rib.
        paint({62, 112, 46}, across > 0 ? bright : 0.8 * bright, leaves->at(u, v));
      }
  }

  void paint_trunk(Raster<4>* canvas) const {
    const int beyond = margin_ + reach_;
    const double left = 0.3 * share_ * width_, right = left + 0.1 * share_ * width_;
    for (int y = beyond + height_ / 4; y < canvas->height; ++y)
      for (int x = 0; x < canvas->width; ++x) {
        const double at = x + 0.5 - beyond;
        if (at >= left && at < right)
          paint({92, 74, 58}, 0.85 + 0.25 * std::sin(12 * (at - left) / (right - left)),
                canvas->at(x, y));
      }
  }

  static void paint(const Colour& colour, double bright, uint8_t* pixel) {
    for (size_t c = 0; c < 3; ++c) pixel[c] = to_level(std::clamp(colour[c] * bright, 16.0, 235.0));
    pixel[3] = 1;
  }

  void bend(double time, Layer* layer) const {
    layer->bends.clear();
    const auto amplitude = static_cast<float>(layer->amplitude);
    for (int j = -before_; j < rows_ - before_; ++j)
      for (int i = -before_; i < columns_ - before_; ++i) {
        const Wind::Bend bend = layer->wind.at(i * kStep, j * kStep, time);
        layer->bends.push_back({amplitude * bend.x, amplitude * bend.y});
      }
  }

  // The nearest leaf at a pixel of the scene's canvas; null: none.
  const uint8_t* seen_at(int x, int y) const {
    const int u = x - margin_ + before_ * kStep, v = y - margin_ + before_ * kStep;
    const float across = static_cast<float>(u % kStep) / kStep;
    const float down = static_cast<float>(v % kStep) / kStep;
    for (const Layer& layer : layers_) {
      const Wind::Bend* above = layer.bends.data() + v / kStep * columns_ + u / kStep;
      const Wind::Bend* below = above + columns_;
      const auto between = [&](float Wind::Bend::*axis) {
        const float a = above[0].*axis + across * (above[1].*axis - above[0].*axis);
        const float b = below[0].*axis + across * (below[1].*axis - below[0].*axis);
        return static_cast<int>(std::lround(a + down * (b - a)));
      };
      const uint8_t* leaf = layer.leaves.at(x + reach_ + between(&Wind::Bend::x),
                                            y + reach_ + between(&Wind::Bend::y));
      if (leaf[3]) return leaf;
    }
    return nullptr;
  }

  double share_, amplitude_, frequency_;
  StreamSource streams_;
  int width_ = 0, height_ = 0, margin_ = 0;  // pixels of the frame, and around it
  double twig_ = 0;                          // pixels between twigs
  int reach_ = 0;                            // pixels that boughs bend at most
  int right_ = 0;                            // of the canvas: where no leaf comes any more
  int before_ = 0, columns_ = 0, rows_ = 0;  // points of the grid: left and above of the frame, all
  std::vector<Layer> layers_;                // the nearest first
};

constexpr Parameter kParameters[] = {
    {"share", "of the picture", 0.33, 0, 1, "where boughs hang"},
    {"amplitude", "px", 5, 0, 50, "how far a bough moves from its place at most"},
    {"frequency", "Hz", 0.5, 0.01, 20, "of the wind"},
};

}  // namespace

const EffectInfo kTrees = {
    "trees",
    "moving background: boughs of trees near the camera sway, with gaps between their leaves; "
    "objects walk behind them, and swaying leaves are background",
    kWorld,
    kRandom | kBuffers,
    kParameters,
    make_effect<Trees>};

}  // namespace qdmd::scene
