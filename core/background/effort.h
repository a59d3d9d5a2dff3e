// What a background is given, and what its solve took.
#pragma once

namespace qdmd {

struct Effort {
  int period = 1;       // of so many windows (live: hops) one is solved
  int iterations = 1;   // of Method::robust
  int sample_step = 1;  // the decomposition sees every k-th pixel in x and y

  bool operator==(const Effort&) const = default;
};

// Seconds of one solve.
struct SolveCost {
  double once = 0;        // before and after the iterations
  double iterations = 0;  // in all of them, whatever the sample step
  double samples = 0;     // in all of them, for each sampled pixel

  double sum() const { return once + iterations + samples; }
};

}  // namespace qdmd
