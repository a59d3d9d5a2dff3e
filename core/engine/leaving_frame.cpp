// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/leaving_frame.h"

#include <algorithm>

#include "core/passes/bands.h"
#include "core/passes/read_samples.h"
#include "core/passes/residual.h"

namespace qdmd {

OutputTask task_of_background(const FrameStore& frames, const BackgroundModel& model) {
  OutputTask task = {};
  // The background needs no frame, but rows of one are skipped over.
  for (int c = 0; c < kChannels; ++c) task.x[c] = frames.window().plane(0, 0);
  task.model = &model;
  task.output = Output::background;
  task.constant_alpha = static_cast<uint16_t>((1 << frames.depth()) - 1);
  return task;
}

namespace {

void enlarge(const Reduction& size, UncoveredPlace* place) {
  place->x *= size.scale;
  place->y *= size.scale;
  place->width = std::min(size.scale * place->width, size.width - place->x);
  place->height = std::min(size.scale * place->height, size.height - place->y);
}

}  // namespace

LeavingFrame::LeavingFrame(const Stage& stage, Schedule* schedule, const Levels& levels, bool soft)
    : stage_(stage), schedule_(schedule), levels_(levels) {
  // Pages are touched once somebody wants more than the background.
  room_ = std::make_unique_for_overwrite<uint8_t[]>(
      room_for_planes(frames().window().shape(), frames().depth()));
  if (soft) soft_mask_ = std::make_unique<SoftMask>(frames().width(), frames().height());
}

void LeavingFrame::flush() {
  done_ = {};
  schedule_->flush();
  if (soft_mask_) soft_mask_->forget();
}

uint64_t LeavingFrame::soft_bytes() const {
  return soft_mask_ ? SoftMask::bytes(frames().width(), frames().height()) : 0;
}

// In pixels of what is learnt.
Pose LeavingFrame::camera() const { return frames().pose(slot()); }

Pose LeavingFrame::pose() const {
  return stage_.enlarger ? enlarged(camera(), stage_.enlarger->size().scale) : camera();
}

bool LeavingFrame::next_uncovered(UncoveredPlace* place) {
  meet();
  UncoveredPlaces* const places = stage_.background->learner().uncovered();
  const int64_t number =
      static_cast<int64_t>(frames().frames_taken()) - frames().size() + schedule_->next_index();
  if (!places || !places->take(number, place)) return false;
  if (stage_.enlarger) qdmd::enlarge(stage_.enlarger->size(), place);
  return true;
}

// Of the frame.
size_t LeavingFrame::pixels() const {
  return stage_.enlarger ? stage_.enlarger->size().pixels() : frames().window().pixels();
}

// Once a frame.
void LeavingFrame::meet() {
  if (done_.meet) return;
  schedule_->meet(schedule_->next_index());
  planes_ = PlaneRows(frames().window().picture(slot()), room_.get());
  done_.meet = true;
}

// What is needed for a picture, without a mask. Samples are where they are, or are going to be.
OutputTask LeavingFrame::task_of(Output output) {
  meet();
  schedule_->show(schedule_->next_index());
  OutputTask task = task_of_background(frames(), stage_.background->model());
  task.output = output;
  for (int c = 0; output != Output::background && c < kChannels; ++c)
    task.x[c] = planes_.samples(c);
  task.alpha = frames().alpha(slot());
  task.constant_alpha = frames().constant_alpha(slot());
  return task;
}

// All of this frame is read, and then the next one.
void LeavingFrame::ask_ahead() const {
  const SnapshotRange frames(this->frames().window());
  frames.will_need(schedule_->next_index());
  frames.will_need(schedule_->next_index() + 1);
}

// Once a frame, where pixels share samples.
void LeavingFrame::read() {
  if (done_.read) return;
  ask_ahead();
  planes_.read_all(pool());
  done_.read = true;
}

// Once a frame.
void LeavingFrame::decide(OutputTask* task) {
  if (!done_.decide) {
    ask_ahead();
    stage_.background->decide(planes_, pool());
  }
  // It has read all rows, too.
  done_.decide = done_.read = true;
  task->mask = stage_.background->decision().mask();
  task->shaded = stage_.background->decision().shaded();
}

// Once a frame.
void LeavingFrame::soften(OutputTask* task) {
  if (!soft_mask_) soft_mask_ = std::make_unique<SoftMask>(frames().width(), frames().height());
  const Background& background = *stage_.background;
  const SoftEdge edge = {wishes().mask_softness, background.report().foreground.threshold};
  const uint8_t* const x[3] = {task->x[0].high, task->x[1].high, task->x[2].high};
  if (!done_.soften) soft_mask_->make(background.decision(), x, edge, wishes().ignored, pool());
  done_.soften = true;
  task->mask = soft_mask_->alpha();
  task->soft = true;
}

// From the canvas to where the frame's camera looked. level: L is needed.
void LeavingFrame::return_to_camera(OutputTask* task, bool level) {
  const Pose pose = camera();
  if (pose.is_rest() || wishes().stabilize_output) return;
  for (int c = 0; c < kChannels; ++c) task->x[c] = frames().untouched(slot(), c);
  Restorer& restorer = *stage_.restorer;
  Resampler* const resampler = &stage_.stabilizer->resampler();
  if (level) {
    restorer.write_canvas(*task->model, frames().window().pixels(), pool());
    restorer.restore_level(pose, task->x, resampler, pool());
    for (int c = 0; c < kChannels; ++c) task->level[c] = restorer.level(c);
    task->level_stride = static_cast<size_t>(frames().width());
  }
  // What is ignored has its place in the frame.
  const auto ignore = [&](uint8_t* mask) {
    wishes().ignored.clear_rows(0, frames().height(), frames().width(), mask);
    return mask;
  };
  if (task->mask)
    task->mask = ignore(restorer.restore_mask(pose, task->mask, !task->soft, resampler, pool()));
  if (task->shaded)
    task->shaded = ignore(restorer.restore_shaded(pose, task->shaded, resampler, pool()));
}

// To the frame's own size, where less was looked at.
void LeavingFrame::enlarge(OutputTask* task) {
  if (!stage_.enlarger) return;
  if (task->mask && (camera().is_rest() || wishes().stabilize_output)) {
    // Frame and L are those that the mask was made of.
    const Decision& decision = stage_.background->decision();
    const uint8_t* level[kChannels];
    decision.level(0, level);
    std::copy_n(level, kChannels, task->level);
    task->level_stride = decision.level_stride();
  }
  stage_.enlarger->enlarge(task, pool());
}

void LeavingFrame::write(Output output, const Levels& levels, const MutableImageView& out) {
  const Clock::Span span(*stage_.clock, Clock::frames);
  flushed_if_it_throws(this, [&] {
    OutputTask task = task_of(output);
    const Decision& decision = stage_.background->decision();
    const bool masked = output == Output::mask || output == Output::cutout;
    if (masked)
      decide(&task);
    else if (output != Output::background)
      read();
    if (done_.decide && !masked && !out.bits.is_deep()) {
      const uint8_t* level[3];
      decision.level(0, level);
      std::copy_n(level, kChannels, task.level);
      task.level_stride = decision.level_stride();
    }
    if (masked && wishes().mask_softness > 0) soften(&task);
    return_to_camera(&task, output == Output::background || output == Output::foreground);
    enlarge(&task);
    write(task, levels, out);
  });
}

void LeavingFrame::write(const OutputTask& task, const Levels& levels,
                         const MutableImageView& out) {
  const int height = out.height, together = rows_together(out);
  const int steps = (height + together - 1) / together;
  const auto write = [&](int first, int count) {
    const int row = first * together;
    write_picture(task, levels, out, row, std::min(count * together, height - row));
  };
  for_rows(pool(), steps, static_cast<size_t>(out.width) * static_cast<size_t>(height), write);
}

void LeavingFrame::write_frame(const Levels& levels, const MutableImageView& out) {
  const Clock::Span span(*stage_.clock, Clock::frames);
  flushed_if_it_throws(this, [&] {
    OutputTask task = task_of(Output::cutout);
    read();
    if (!camera().is_rest() && !wishes().stabilize_output)
      for (int c = 0; c < kChannels; ++c) task.x[c] = frames().untouched(slot(), c);
    enlarge(&task);
    // All of it is cut out.
    everything_.resize(pixels(), 255);
    task.mask = everything_.data();
    write(task, levels, out);
  });
}

const uint8_t* LeavingFrame::mask() {
  const Clock::Span span(*stage_.clock, Clock::frames);
  return flushed_if_it_throws(this, [&] {
    OutputTask task = task_of(Output::mask);
    decide(&task);
    return_to_camera(&task, false);
    enlarge(&task);
    return task.mask;
  });
}

void LeavingFrame::foreground(uint8_t* mask, uint8_t* residual) {
  const Clock::Span span(*stage_.clock, Clock::frames);
  flushed_if_it_throws(this, [&] {
    OutputTask task = task_of(Output::mask);
    decide(&task);
    return_to_camera(&task, true);
    uint8_t* const lengths = stage_.enlarger ? stage_.enlarger->room() : residual;
    const auto width = static_cast<size_t>(frames().width());
    for (int y = 0; y < frames().height(); ++y) {
      const size_t first = static_cast<size_t>(y) * width;
      const uint8_t* const x[3] = {task.x[0].high + first, task.x[1].high + first,
                                   task.x[2].high + first};
      const uint8_t* level[3];
      stage_.background->decision().level(y, level);
      for (int c = 0; task.level[0] && c < kChannels; ++c) level[c] = task.level[c].high + first;
      residual_norm(x, level, width, lengths + first);
    }
    if (stage_.enlarger) stage_.enlarger->repeat(lengths, residual, pool());
    enlarge(&task);
    std::copy_n(task.mask, pixels(), mask);
  });
}

void LeavingFrame::skip() {
  flushed_if_it_throws(this, [&] { schedule_->leave(); });
  if (soft_mask_ && !done_.soften) soft_mask_->forget();
  done_ = {};
}

void LeavingFrame::pop(Output output, const MutableImageView& out) {
  write(output, levels_, out);
  skip();
}

}  // namespace qdmd
