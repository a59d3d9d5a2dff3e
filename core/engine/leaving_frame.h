// SPDX-License-Identifier: LGPL-2.1-or-later
// The frame that leaves next: its pictures, its mask, and where its camera looked.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/engine/schedule.h"
#include "core/foreground/picture.h"
#include "core/foreground/soft_mask.h"

namespace qdmd {

// An engine has one, which stands for one frame after the other: any number of pictures are made
// from one computation, and then the frame leaves. Calls are only while a frame is ready
// (Engine::next()). Each may wait for a solve. May throw std::bad_alloc; frames that wait are then
// lost, as after flush().
class LeavingFrame {
 public:
  // Works on what `stage` names, whose background knows what is wished, and on frames that
  // `schedule` gives. levels: of the frames. soft: takes the memory of soft masks now.
  LeavingFrame(const Stage& stage, Schedule* schedule, const Levels& levels, bool soft);

  // Writes a picture. `out` has the configured size; `levels` are its black, white and neutral
  // chroma: the configured ones, or, for a mask in another format, the levels of that format.
  // Samples have the configured depth, or 8 bits: the highest ones.
  void write(Output output, const Levels& levels, const MutableImageView& out);
  // The mask, as in Output::mask but hard: 255 where foreground, else 0, width * height samples in
  // row order. Good until the next call.
  const uint8_t* mask();
  // Gives the same, and the lengths of the residuals in levels, at most 255;
  // width * height samples each.
  void foreground(uint8_t* mask, uint8_t* residual);
  // Writes the frame as it came (on the canvas, if pictures are steady), like write().
  void write_frame(const Levels& levels, const MutableImageView& out);
  // Where the camera looked.
  Pose pose() const;
  // The next place, each once, where this frame and those before it show that something has left
  // which belonged to the background; places are those of the canvas. False: there is none.
  // Method::robust only.
  bool next_uncovered(UncoveredPlace* place);
  // It leaves. Call it once its pictures are written, if anybody wants some.
  void skip();
  // write() in the configured levels, and skip().
  void pop(Output output, const MutableImageView& out);

  // All frames are dropped, and the background is forgotten.
  void flush();
  // Bytes that soft masks have taken.
  uint64_t soft_bytes() const;

 private:
  // What was done for the frame so far.
  struct Done {
    bool meet = false, read = false, decide = false, soften = false;
  };

  Pose camera() const;
  OutputTask task_of(Output output);
  void meet();
  void ask_ahead() const;
  void read();
  void decide(OutputTask* task);
  void soften(OutputTask* task);
  void write(const OutputTask& task, const Levels& levels, const MutableImageView& out);
  void return_to_camera(OutputTask* task, bool level);
  void enlarge(OutputTask* task);
  size_t pixels() const;
  FrameStore& frames() const { return *stage_.frames; }
  const Wishes& wishes() const { return stage_.background->wishes(); }
  int slot() const { return frames().slot(schedule_->next_index()); }
  Pool* pool() const { return stage_.workers->idle_pool(); }

  Stage stage_;
  Schedule* schedule_;
  Levels levels_;
  std::unique_ptr<SoftMask> soft_mask_;
  Done done_;
  std::vector<uint8_t> everything_;  // a mask that is set everywhere, once somebody wants a frame
  // The planes. Where pixels share samples, `room_` has those of each pixel.
  PlaneRows planes_;
  std::unique_ptr<uint8_t[]> room_;
};

// What is needed for a picture of L at the time that the model is set to.
OutputTask task_of_background(const FrameStore& frames, const BackgroundModel& model);

// Returns what `action` does. What an exception leaves half done is dropped by the owner.
template <typename Owner, typename Action>
auto flushed_if_it_throws(Owner* owner, Action action) {
  try {
    return action();
  } catch (...) {
    owner->flush();
    throw;
  }
}

}  // namespace qdmd
