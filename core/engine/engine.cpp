// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/engine.h"

#include <utility>

#include "core/engine/batch_schedule.h"
#include "core/engine/live_schedule.h"

namespace qdmd {

Status Engine::configure(const EngineOptions& options, int width, int height) try {
  EnginePlan plan(options, width, height);
  if (!plan.status().ok()) return plan.status();
  // The old window goes first: two at once would break the promise of max-memory.
  close();
  plan_ = std::move(plan);
  const EngineLayout& layout = plan_.layout();
  const Reduction& size = plan_.size();
  // Of what is learnt.
  const int small_width = size.small_width(), small_height = size.small_height();
  const bool live = options.mode == Mode::live;
  auto learner = plan_.take_learner();
  // What processes add up has one order.
  workers_ = std::make_unique<Workers>(options.threads, !options.add);
  const uint64_t beside = layout.bytes - layout.store_bytes;
  PageFile file;
  if (!options.window_on_disk.empty())
    if (Status status = file.take(options.window_on_disk, layout.frame_bytes); !status.ok()) {
      close();
      return status;
    }
  frames_ = FrameStore(layout.capacity, small_width, small_height, learner->contents(),
                       options.max_memory - beside, std::move(file));
  if (size.is_reduced()) {
    reducer_ = std::make_unique<FrameReducer>(size, options.depth);
    enlarger_ = std::make_unique<Enlarger>(size, options.depth);
  }
  pace_.begin(front_of_efforts(learner->sample_steps()),
              live ? plan_.live().hop_size() : options.window_size);
  DecisionSteps steps = at_rate(options.steps, options.frame_rate);
  // There the edge is looked for in pixels that a thing covers in part.
  if (size.is_reduced()) steps.edges = false;
  background_ = std::make_unique<Background>(
      std::move(learner),
      LearnerRoom{&frames_, options.window_size, plan_.models(), &workers_->pool(), &clock_},
      options.colours, steps, options.levels);
  if (options.stabilize != Stabilize::off) {
    stabilizer_ =
        std::make_unique<Stabilizer>(options.stabilize, options.colours, small_width, small_height);
    restorer_ = std::make_unique<Restorer>(small_width, small_height, options.depth);
  }
  const Stage stage = {&frames_, background_.get(), workers_.get(),  &pace_,
                       &clock_,  stabilizer_.get(), restorer_.get(), enlarger_.get()};
  if (live)
    schedule_ = std::make_unique<LiveSchedule>(stage, plan_.live());
  else
    schedule_ = std::make_unique<BatchSchedule>(stage, options.window_size, layout.late_frames);
  leaving_ = std::make_unique<LeavingFrame>(stage, schedule_.get(), options.levels,
                                            options.mask_softness > 0);
  wishes_ = first_wishes(options);
  follow_wishes();
  return {};
} catch (...) {
  close();
  throw;
}

void Engine::close() {
  flush();
  leaving_.reset();
  schedule_.reset();
  // The threads end before what they work on.
  workers_.reset();
  background_.reset();
  stabilizer_.reset();
  restorer_.reset();
  enlarger_.reset();
  reducer_.reset();
  frames_ = FrameStore();
  plan_ = EnginePlan();
}

void Engine::flush() {
  if (leaving_) leaving_->flush();
}

void Engine::go_on() {
  if (configured() && schedule_->queue().pending == 0) schedule_->go_on();
}

void Engine::follow_wishes() {
  if (enlarger_) enlarger_->set_ignored(wishes_.ignored);
  background_->set_wishes(plan_.wishes_of(wishes_));
}

Status Engine::push(const ImageView& frame, const Wishes* wishes) {
  if (Status status = check(frame); !status.ok()) return status;
  const Clock::Span span(clock_, Clock::frames);
  return flushed_if_it_throws(this, [&]() -> Status {
    if (wishes) {
      static_cast<LearnWishes&>(wishes_) = *wishes;
      wishes_.ignored = wishes->ignored;
      follow_wishes();
      workers_->ask_for(wishes_.threads);
      pace_.set_budget(wishes_.time_budget);
    }
    workers_->follow();
    if (schedule_->push(reducer_ ? reducer_->reduce(frame, workers_->idle_pool()) : frame))
      return {};
    flush();
    return plan_.alpha_refused(frames_.bytes_with_alpha());
  });
}

Status Engine::check(const ImageView& frame) const {
  using Code = Status::Code;
  if (!configured()) return {Code::not_configured, "configure the engine before pushing frames"};
  if (schedule_->queue().ready > 0)
    return {Code::frames_are_waiting, "pop the frames that are ready before pushing more"};
  if (frame.width != plan_.size().width || frame.height != plan_.size().height)
    return {Code::invalid_options, "configure the engine anew for frames of another size"};
  if (frame.bits.depth != plan_.options().depth)
    return {Code::invalid_options, "configure the engine anew for samples of other depth"};
  const Spacing chroma = frame.spacing(1);
  const ChromaShape& shape = frames_.window().shape();
  if (shape.is_shared() && (chroma.columns != shape.columns || chroma.rows != shape.rows))
    return {Code::invalid_options,
            "configure the engine anew for frames whose pixels share other samples"};
  return {};
}

LeavingFrame* Engine::next(const Wishes* wishes) {
  if (!configured() || schedule_->queue().ready == 0) return nullptr;
  if (wishes) {
    static_cast<PictureWishes&>(wishes_) = *wishes;
    wishes_.ignored = wishes->ignored;
    follow_wishes();
  }
  return leaving_.get();
}

Status Engine::drain() {
  if (!configured())
    return {Status::Code::not_configured, "configure the engine before draining it"};
  const Clock::Span span(clock_, Clock::frames);
  return flushed_if_it_throws(this, [&]() -> Status {
    schedule_->drain();
    // An old background says nothing of what comes after.
    pace_.solve_next();
    return {};
  });
}

bool Engine::write_background(const MutableImageView& out) {
  if (!configured() || !background_->known()) return false;
  schedule_->show_newest();
  OutputTask task = task_of_background(frames_, background_->model());
  if (enlarger_) enlarger_->enlarge(&task, workers_->idle_pool());
  write_picture(task, plan_.options().levels, out, 0, out.height);
  return true;
}

bool Engine::learnt(Learnt* learnt) {
  if (!configured() || !background_->known()) return false;
  // What it threw, the next frame is told.
  workers_->rest();
  schedule_->show_newest();
  Learnt all;
  all.width = frames_.width();
  all.height = frames_.height();
  background_->remember(&all);
  *learnt = std::move(all);
  return true;
}

Status Engine::learn_from(const Learnt& learnt) {
  if (!configured()) return {Status::Code::not_configured, "configure the engine before it learns"};
  if (Status status = plan_.may_learn_from(learnt); !status.ok()) return status;
  workers_->rest();
  schedule_->learn_from(learnt);
  return {};
}

EngineReport Engine::report() const {
  EngineReport report;
  report.effort = pace_.budget().effort();
  report.costs = pace_.budget().costs();
  if (!configured()) return report;
  const EngineLayout& layout = plan_.layout();
  report.solve = background_->report();
  report.solves = background_->solves();
  report.scenes = schedule_->scenes();
  report.delay = layout.delay;
  report.pending = schedule_->queue().pending;
  report.frames_left = schedule_->frames_left();
  report.held_up = schedule_->held_up();
  report.no_room_for_motion = schedule_->has_no_room();
  report.bytes = layout.bytes - layout.store_bytes - layout.soft_bytes + frames_.bytes() +
                 leaving_->soft_bytes();
  if (stabilizer_) {
    report.views = stabilizer_->views();
    report.newest_pose = enlarged(stabilizer_->motion(), plan_.size().scale);
  }
  return report;
}

}  // namespace qdmd
