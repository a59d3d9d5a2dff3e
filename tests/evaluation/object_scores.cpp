// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/object_scores.h"

#include <cstdio>
#include <set>

#include "core/objects/assignment.h"

namespace qdmd::evaluation {

namespace {

constexpr double kPair = 0.5;

}  // namespace

void TrackingScores::add_frame(const std::vector<NumberedBox>& truth,
                               const std::vector<NumberedBox>& found) {
  true_boxes_ += std::ssize(truth);
  found_boxes_ += std::ssize(found);
  for (const NumberedBox& t : truth)
    for (const NumberedBox& f : found)
      if (overlap(t.box, f.box) >= kPair) ++pairs_[{t.id, f.id}];
  std::vector<int> pair_of(truth.size(), -1);
  std::vector<char> taken(found.size());
  for (size_t t = 0; t < truth.size(); ++t) {
    const auto before = before_.find(truth[t].id);
    for (size_t f = 0; before != before_.end() && f < found.size(); ++f) {
      if (found[f].id != before->second || taken[f]) continue;
      if (overlap(truth[t].box, found[f].box) < kPair) continue;
      pair_of[t] = static_cast<int>(f);
      taken[f] = 1;
    }
  }
  std::vector<size_t> rest, free;
  for (size_t t = 0; t < truth.size(); ++t)
    if (pair_of[t] < 0) rest.push_back(t);
  for (size_t f = 0; f < found.size(); ++f)
    if (!taken[f]) free.push_back(f);
  std::vector<double> cost;
  for (size_t t : rest)
    for (size_t f : free) {
      const double its = overlap(truth[t].box, found[f].box);
      cost.push_back(its >= kPair ? 1 - its : 1000);
    }
  Assignment assignment;
  const std::vector<int>& chosen = assignment.solve(cost, rest.size(), free.size());
  for (size_t i = 0; i < rest.size(); ++i) {
    if (chosen[i] < 0) continue;
    const size_t f = free[static_cast<size_t>(chosen[i])];
    if (overlap(truth[rest[i]].box, found[f].box) < kPair) continue;
    pair_of[rest[i]] = static_cast<int>(f);
    const auto before = before_.find(truth[rest[i]].id);
    switches_ += before != before_.end() && before->second != found[f].id;
  }
  int64_t pairs = 0;
  for (size_t t = 0; t < truth.size(); ++t) {
    if (pair_of[t] < 0) continue;
    ++pairs;
    before_[truth[t].id] = found[static_cast<size_t>(pair_of[t])].id;
  }
  missed_ += std::ssize(truth) - pairs;
  wrong_ += std::ssize(found) - pairs;
}

// The pairs of whole tracks that have most frames together.
void TrackingScores::finish() {
  std::set<int64_t> truths, founds;
  for (const auto& [pair, frames] : pairs_) truths.insert(pair.first), founds.insert(pair.second);
  std::vector<double> cost;
  for (int64_t t : truths)
    for (int64_t f : founds) {
      const auto at = pairs_.find({t, f});
      cost.push_back(at == pairs_.end() ? 0 : -static_cast<double>(at->second));
    }
  Assignment assignment;
  const std::vector<int>& chosen = assignment.solve(cost, truths.size(), founds.size());
  for (size_t t = 0; t < truths.size(); ++t)
    if (chosen[t] >= 0)
      together_ -= static_cast<int64_t>(cost[t * founds.size() + static_cast<size_t>(chosen[t])]);
  pairs_.clear();
  before_.clear();
}

void TrackingScores::add(TrackingScores other) {
  true_boxes_ += other.true_boxes_, found_boxes_ += other.found_boxes_;
  missed_ += other.missed_, wrong_ += other.wrong_, switches_ += other.switches_;
  together_ += other.together_;
}

double TrackingScores::mota() const {
  return 1 - static_cast<double>(missed_ + wrong_ + switches_) /
                 static_cast<double>(std::max<int64_t>(1, true_boxes_));
}

double TrackingScores::idf1() const {
  return 2.0 * static_cast<double>(together_) /
         static_cast<double>(std::max<int64_t>(1, true_boxes_ + found_boxes_));
}

void EventScores::add(const EventScores& other) {
  true_events += other.true_events, in_time += other.in_time, late += other.late;
  missed += other.missed, wrong += other.wrong;
  delays.insert(delays.end(), other.delays.begin(), other.delays.end());
}

EventScores score_events(const std::vector<TimedEvent>& truth, const std::vector<TimedEvent>& told,
                         const TrueBox& true_box, ObjectEvent::Kind kind, int last,
                         const char* verbose) {
  EventScores scores;
  std::vector<char> taken(told.size());
  const bool whole =
      kind == ObjectEvent::Kind::motion_begins || kind == ObjectEvent::Kind::motion_ends;
  const bool is_past = kind == ObjectEvent::Kind::gone || kind == ObjectEvent::Kind::removed;
  const auto box_of = [&](const TimedEvent& event, int frame) {
    const ObjectBox* const box = is_past ? nullptr : true_box(event.owner, frame);
    return box ? *box : event.box;
  };
  const auto show = [&](const char* what, const TimedEvent& event, int delay) {
    if (verbose)
      std::printf("  %s: %s %s frame %d delay %d at %.0f,%.0f %.0fx%.0f\n", verbose, what,
                  name_of(kind), event.frame, delay, event.box.x, event.box.y, event.box.width,
                  event.box.height);
  };
  for (const TimedEvent& event : truth) {
    if (event.kind != kind) continue;
    const bool counts = event.frame + kLate <= last;
    scores.true_events += counts;
    const TimedEvent* best = nullptr;
    for (const TimedEvent& one : told) {
      if (one.kind != kind || taken[static_cast<size_t>(&one - told.data())]) continue;
      const int delay = one.frame - event.frame;
      if (delay < -kEarly || delay > kMuchLate) continue;
      if (!whole && overlap(one.box, box_of(event, one.frame)) < kPair) continue;
      if (!best || one.frame < best->frame) best = &one;
    }
    if (!best) {
      if (counts) ++scores.missed, show("missed", event, 0);
      continue;
    }
    taken[static_cast<size_t>(best - told.data())] = 1;
    if (!counts) continue;
    const int delay = best->frame - event.frame;
    scores.delays.push_back(delay);
    if (delay > kLate)
      ++scores.late, show("late", event, delay);
    else
      ++scores.in_time;
  }
  for (const TimedEvent& one : told) {
    if (one.kind != kind || taken[static_cast<size_t>(&one - told.data())]) continue;
    ++scores.wrong;
    show("wrong", one, 0);
  }
  return scores;
}

}  // namespace qdmd::evaluation
