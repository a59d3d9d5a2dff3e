// SPDX-License-Identifier: LGPL-2.1-or-later
// What was spent where: seconds of each kind of work, whichever thread did it.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace qdmd {

// One clock is passed down to all code that works on frames; the engine's caller charges it, too.
// Any thread may charge it. If you read it while others work, you see what they have charged so
// far.
class Clock {
 public:
  enum Work : size_t {
    frames,    // frames in and pictures out, and all that is none of the others
    waiting,   // for work that another thread does, which charges for it itself
    products,  // the inner products of frames as they come
    solving,   // from a window to its model, less the following two
    pictures,  // the modes' pictures and the foreground's statistics
    samples,   // what a solve does with each sampled pixel
    kWorks
  };

  // Seconds of each kind.
  class Spent {
   public:
    double of(Work work) const { return seconds_[work]; }
    double of_solves() const { return of(solving) + of(pictures) + of(samples); }
    // All seconds in which threads worked, without waiting.
    double all() const { return of(frames) + of(products) + of_solves(); }
    Spent since(const Spent& earlier) const {
      Spent difference;
      for (size_t work = 0; work < kWorks; ++work)
        difference.seconds_[work] = seconds_[work] - earlier.seconds_[work];
      return difference;
    }

   private:
    friend class Clock;
    std::array<double, kWorks> seconds_{};
  };
  // Since the clock was made.
  Spent spent() const;
  // For work that was timed elsewhere, as tests do.
  void charge(Work work, double seconds);

  // Charges the time for which it lives to one kind of work, less the time of spans inside it on
  // the same thread.
  class Span {
   public:
    Span(Clock& clock, Work work);
    ~Span();
    Span(const Span&) = delete;
    Span& operator=(const Span&) = delete;

   private:
    using Time = std::chrono::steady_clock::time_point;
    void charge(Time now);

    Clock& clock_;
    Work work_;
    Span* outer_;
    Time start_;
  };

 private:
  std::array<std::atomic<int64_t>, kWorks> nanoseconds_{};
};

}  // namespace qdmd
