// Frames leave a window at a time, each against its own window's model.
#pragma once

#include <optional>

#include "core/engine/schedule.h"

namespace qdmd {

// A window is collected; its frames enter the Gram matrix in groups, beside those that follow. The
// last one solves. Where the background is held, which is decided when a window begins, its frames
// wait all the same. What drain() finds is solved with as many frames before it as make a window.
class BatchSchedule : public Schedule {
 public:
  BatchSchedule(const Stage& stage, int window_size) : Schedule(stage), window_size_(window_size) {}

  bool push(const ImageView& frame, bool freeze, Queue* queue) override;
  void drain(Queue* queue) override;
  void restart() override;
  void show(int index) override;
  void show_newest() override;

 private:
  // Frames on their way into the Gram matrix.
  struct Group {
    SnapshotRange span;
    int frames;
  };

  void begin_window(bool freeze);
  void add_group(const SnapshotRange& span);
  void solve(Queue* queue);

  int window_size_;
  bool start_new_window_ = false;
  int not_added_ = 0;           // newest frames whose inner products are not computed yet
  std::optional<Group> group_;  // what the side thread is at
};

}  // namespace qdmd
