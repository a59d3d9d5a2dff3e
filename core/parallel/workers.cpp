#include "core/parallel/workers.h"

#include <algorithm>
#include <thread>

namespace qdmd {

int Workers::count(int threads) {
  if (threads > 0) return std::min(threads, kMost);
  // Zero where the system does not tell.
  return static_cast<int>(
      std::clamp<unsigned>(std::thread::hardware_concurrency(), 1, unsigned{kMost}));
}

Workers::Workers(int threads, bool beside)
    : threads_(threads),
      asked_(threads),
      beside_(beside),
      pool_(count(threads)),
      side_(may_work_beside(threads)) {}

void Workers::follow() {
  if (asked_ == threads_ || !side_.idle()) return;
  threads_ = asked_;
  pool_.resize(count(threads_));
  side_.set_active(may_work_beside(threads_));
}

// A core that all threads share goes from one to the other: frames pass while a solve goes on.
bool Workers::may_work_beside(int threads) const { return beside_ && threads != 1; }

}  // namespace qdmd
