#include "core/background/robust/fill.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/background/robust/fill.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

// Plain loops over one row, which the compiler makes vectors of for each instruction set.

// The quaternion norm of x - l, rounded down, at most 255.
void norm_row(const uint8_t* HWY_RESTRICT xr, const uint8_t* HWY_RESTRICT xg,
              const uint8_t* HWY_RESTRICT xb, const uint8_t* HWY_RESTRICT lr,
              const uint8_t* HWY_RESTRICT lg, const uint8_t* HWY_RESTRICT lb, size_t count,
              uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i) {
    const int r = xr[i] - lr[i], g = xg[i] - lg[i], b = xb[i] - lb[i];
    const float norm = std::sqrt(static_cast<float>(r * r + g * g + b * b));
    out[i] = static_cast<uint8_t>(static_cast<int>(norm < 255.0f ? norm : 255.0f));
  }
}

void scale_row(const uint8_t* HWY_RESTRICT from, size_t count, float factor,
               uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i) {
    const float level = static_cast<float>(from[i]) * factor + 0.5f;
    out[i] = static_cast<uint8_t>(static_cast<int>(level < 255.0f ? level : 255.0f));
  }
}

// padded: two samples before the row's first and two after its last.
void sum_columns(const uint8_t* HWY_RESTRICT padded, size_t count, uint16_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint16_t>(padded[i] + padded[i + 1] + padded[i + 2] + padded[i + 3] +
                                   padded[i + 4]);
}

void sum_rows(const uint16_t* const* rows, size_t count, uint16_t* HWY_RESTRICT out) {
  const uint16_t *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3], *e = rows[4];
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint16_t>(a[i] + b[i] + c[i] + d[i] + e[i]);
}

// The frame's sample where sums are at most 25 threshold, else the background's.
void choose_row(const uint16_t* HWY_RESTRICT sums, const uint8_t* HWY_RESTRICT threshold,
                const uint8_t* HWY_RESTRICT x, const uint8_t* HWY_RESTRICT l, size_t count,
                uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i)
    out[i] = sums[i] > static_cast<uint16_t>(25 * threshold[i]) ? l[i] : x[i];
}

// Samples farther than `reach` from the background are drawn to it, all are weighted a half more:
// one step of Huber's estimate of the mean (Robust Statistics, 1981), where most of the samples are
// within reach.
void pull_row(const uint8_t* HWY_RESTRICT l, const uint8_t* HWY_RESTRICT reach, size_t count,
              uint8_t* HWY_RESTRICT samples) {
  for (size_t i = 0; i < count; ++i) {
    const int limit = reach[i], away = samples[i] - l[i];
    const int near = away < -limit ? -limit : away > limit ? limit : away;
    // Halves are rounded away from the background: upwards, they would brighten it.
    const int level = l[i] + (3 * near + (near > 0) - (near < 0)) / 2;
    samples[i] = static_cast<uint8_t>(level < 0 ? 0 : level > 255 ? 255 : level);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(norm_row);
HWY_EXPORT(scale_row);
HWY_EXPORT(sum_columns);
HWY_EXPORT(sum_rows);
HWY_EXPORT(choose_row);
HWY_EXPORT(pull_row);

constexpr int kReach = 2;  // pixels around one that judge it with it
constexpr int kRows = 2 * kReach + 1;

// The sums over kRows samples of a row, the border's samples standing for those outside.
// padded: room for width + 2 kReach.
void sum_row(const uint8_t* row, size_t width, uint8_t* padded, uint16_t* out) {
  std::memset(padded, row[0], kReach);
  std::memcpy(padded + kReach, row, width);
  std::memset(padded + kReach + width, row[width - 1], kReach);
  HWY_DYNAMIC_DISPATCH(sum_columns)(padded, width, out);
}

// A ring of the sums of the last kRows rows.
class RowSums {
 public:
  RowSums(uint16_t* memory, size_t width) : memory_(memory), width_(width) {}
  uint16_t* of(int row) { return memory_ + static_cast<size_t>(row % kRows) * width_; }
  // Of the rows around `row`, as far as there are any.
  void around(int row, int height, uint16_t* out) {
    const uint16_t* rows[kRows];
    for (int i = 0; i < kRows; ++i) rows[i] = of(std::clamp(row + i - kReach, 0, height - 1));
    HWY_DYNAMIC_DISPATCH(sum_rows)(rows, width_, out);
  }

 private:
  uint16_t* memory_;
  size_t width_;
};

}  // namespace

void fill_rows(const Reference& reference, const uint8_t* const x[3], const Gain& gain,
               int first_row, int row_count, uint8_t* const out[3], std::vector<uint8_t>* scratch) {
  const auto width = static_cast<size_t>(reference.width);
  const bool lit = is_lit(gain);
  scratch->resize(width * (2 * (kRows + 1) + 5) + 2 * kReach + 64);
  auto* sums = reinterpret_cast<uint16_t*>(scratch->data());
  RowSums ring(sums + width, width);
  uint8_t* norm = scratch->data() + 2 * width * (kRows + 1);
  uint8_t* padded = norm + width;
  uint8_t* lit_rows[3] = {padded + width + 2 * kReach, padded + 2 * width + 2 * kReach,
                          padded + 3 * width + 2 * kReach};
  int next = std::max(0, first_row - kReach);
  for (int row = first_row; row < first_row + row_count; ++row) {
    for (; next <= std::min(reference.height - 1, row + kReach); ++next) {
      const size_t start = static_cast<size_t>(next) * width;
      const uint8_t* l[3];
      for (size_t c = 0; c < 3; ++c) {
        l[c] = reference.level[c].data() + start;
        if (!lit) continue;
        HWY_DYNAMIC_DISPATCH(scale_row)(l[c], width, gain[c], lit_rows[c]);
        l[c] = lit_rows[c];
      }
      HWY_DYNAMIC_DISPATCH(norm_row)
      (x[0] + start, x[1] + start, x[2] + start, l[0], l[1], l[2], width, norm);
      sum_row(norm, width, padded, ring.of(next));
    }
    ring.around(row, reference.height, sums);
    const size_t start = static_cast<size_t>(row) * width;
    for (size_t c = 0; c < 3; ++c) {
      uint8_t* to = out[c] + static_cast<size_t>(row - first_row) * width;
      const uint8_t* from = x[c] + start;
      const uint8_t* level = reference.level[c].data() + start;
      if (lit) {
        HWY_DYNAMIC_DISPATCH(scale_row)(from, width, 1 / gain[c], lit_rows[c]);
        from = lit_rows[c];
      }
      HWY_DYNAMIC_DISPATCH(choose_row)
      (sums, reference.threshold.data() + start, from, level, width, to);
      if (!reference.reach.empty())
        HWY_DYNAMIC_DISPATCH(pull_row)(level, reference.reach.data() + start, width, to);
    }
  }
}

void fill_samples(const Reference& reference, const uint8_t* const x[3], const Gain& gain, int step,
                  uint8_t* const out[3]) {
  size_t sample = 0;
  for (int row = 0; row < reference.height; row += step)
    for (int col = 0; col < reference.width; col += step, ++sample) {
      const auto p = static_cast<size_t>(row) * static_cast<size_t>(reference.width) +
                     static_cast<size_t>(col);
      float unit[3], squared = 0;
      for (size_t c = 0; c < 3; ++c) {
        const float level = reference.level[c][p];
        const float away = static_cast<float>(x[c][p]) - level * gain[c];
        squared += away * away;
        unit[c] = static_cast<float>(x[c][p]) / gain[c];
      }
      const float limit = reference.threshold[p];
      const bool foreground = squared > limit * limit;
      for (size_t c = 0; c < 3; ++c)
        out[c][sample] = foreground ? reference.level[c][p]
                                    : static_cast<uint8_t>(std::min(255.0f, unit[c] + 0.5f));
    }
}

Gain refine_gain(const Reference& reference, const uint8_t* const x[3], const Gain& gain,
                 int step) {
  // Where less fits, the gain would be of what moves.
  constexpr double kLeastShare = 0.1;
  Gain refined = gain;
  for (int round = 0; round < 2; ++round) {
    double product[3] = {0, 0, 0}, square[3] = {0, 0, 0};
    size_t fit = 0, seen = 0;
    for (int row = 0; row < reference.height; row += step)
      for (int col = 0; col < reference.width; col += step, ++seen) {
        const auto p = static_cast<size_t>(row) * static_cast<size_t>(reference.width) +
                       static_cast<size_t>(col);
        float squared = 0;
        int brightest = 0;
        for (size_t c = 0; c < 3; ++c) {
          const float away =
              static_cast<float>(x[c][p]) - static_cast<float>(reference.level[c][p]) * refined[c];
          squared += away * away;
          brightest = std::max<int>(brightest, x[c][p]);
        }
        const float limit = reference.threshold[p];
        if (squared >= limit * limit || brightest >= 250) continue;
        ++fit;
        for (size_t c = 0; c < 3; ++c) {
          product[c] += x[c][p] * reference.level[c][p];
          square[c] += reference.level[c][p] * reference.level[c][p];
        }
      }
    if (static_cast<double>(fit) < kLeastShare * static_cast<double>(seen)) break;
    for (size_t c = 0; c < 3; ++c)
      if (product[c] > 0) refined[c] = static_cast<float>(product[c] / square[c]);
  }
  return refined;
}

void blur(const uint8_t* plane, int width, int height, uint8_t* out) {
  const auto w = static_cast<size_t>(width);
  std::vector<uint16_t> memory(w * (kRows + 1));
  std::vector<uint8_t> padded(w + 2 * kReach);
  RowSums ring(memory.data() + w, w);
  int next = 0;
  for (int row = 0; row < height; ++row) {
    for (; next <= std::min(height - 1, row + kReach); ++next)
      sum_row(plane + static_cast<size_t>(next) * w, w, padded.data(), ring.of(next));
    ring.around(row, height, memory.data());
    for (size_t x = 0; x < w; ++x)
      out[static_cast<size_t>(row) * w + x] = static_cast<uint8_t>((memory[x] + 12) / 25);
  }
}

}  // namespace qdmd
#endif
