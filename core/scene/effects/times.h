// SPDX-License-Identifier: LGPL-2.1-or-later
// When a disturbance is there: from a time on for some seconds, and again after a period.
#pragma once

#include <cmath>
#include <optional>

#include "core/scene/effect.h"

namespace qdmd::scene {

class Times {
 public:
  // The values of kFrom, kSeconds and kEvery.
  explicit Times(Values values) : from_(values[0]), seconds_(values[1]), every_(values[2]) {}

  // Seconds since the disturbance that is there at `time` began; nothing where none is.
  std::optional<double> since(double time) const {
    const double passed = time - from_ + kSlack;
    if (passed < 0) return std::nullopt;
    const double here = every_ > 0 ? std::fmod(passed, every_) : passed;
    if (here >= seconds_) return std::nullopt;
    return std::max(0.0, here - kSlack);
  }
  bool on(double time) const { return since(time).has_value(); }
  double seconds() const { return seconds_; }

  static constexpr Parameter kFrom{"from", "s", 2, 0, 1e6, "when it begins"};
  static constexpr Parameter kSeconds{"seconds", "s", 0.5, 0, 1e6, "how long it lasts"};
  static constexpr Parameter kEvery{"every", "s", 0,
                                    0,       1e6, "after which it comes again; 0: never"};

 private:
  // Forgives the rounding of a frame's time.
  static constexpr double kSlack = 5e-7;

  double from_, seconds_, every_;
};

}  // namespace qdmd::scene
