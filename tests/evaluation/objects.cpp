// SPDX-License-Identifier: LGPL-2.1-or-later
// How well things are followed and told of, in simulated scenes whose truth is known: the tables of
// docs/objects.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>

#include "core/objects/object_tracker.h"
#include "tests/evaluation/object_scenes.h"
#include "tests/evaluation/object_scores.h"

namespace qdmd::evaluation {
namespace {

using Kind = ObjectEvent::Kind;
constexpr Kind kKinds[] = {Kind::appeared, Kind::stopped, Kind::left_behind,   Kind::removed,
                           Kind::moved_on, Kind::gone,    Kind::motion_begins, Kind::motion_ends};

int64_t time_of(const ObservedScene& scene, size_t frame) {
  return static_cast<int64_t>(static_cast<double>(frame) / scene.rate * kSecond);
}

// What the true boxes are told of, by the same rules: each thing for itself.
std::vector<TimedEvent> true_events(const ObservedScene& scene, const ObjectOptions& options) {
  struct Thing {
    ObjectLife life;
    ObjectBox box;
    int64_t seen = 0;
    bool appeared = false, stopped = false, left = false, over = false, known = true;
  };
  std::map<int64_t, Thing> things;
  std::map<int64_t, ObjectBox> taken;
  std::vector<TimedEvent> events;
  const auto frame_time = static_cast<int64_t>(kSecond / scene.rate);
  int64_t moved = kNoTime;
  bool in_motion = false;
  for (size_t k = 0; k < scene.frames.size(); ++k) {
    const int frame = static_cast<int>(k);
    const int64_t time = time_of(scene, k);
    const auto& truth = scene.frames[k].truth;
    for (const NumberedBox& one : truth) {
      const auto [at, fresh] =
          things.try_emplace(one.id, Thing{{options, scene.width, scene.height}, {}});
      // What begins to move where it belonged to the background was removed from there.
      if (fresh && k > 0 && one.box.x > 0 && one.box.right() < scene.width &&
          one.box.width > scene.width / 5)
        taken[one.id] = one.box;
      at->second.box = one.box;
    }
    // It is known to be taken a second after nothing of it is left there.
    for (auto at = taken.begin(); at != taken.end();) {
      const auto its = std::find_if(truth.begin(), truth.end(),
                                    [&](const NumberedBox& one) { return one.id == at->first; });
      if (its != truth.end() && shared(its->box, at->second) > 0) {
        ++at;
        continue;
      }
      events.push_back(
          {Kind::removed, at->first, frame + static_cast<int>(scene.rate), at->second});
      at = taken.erase(at);
    }
    bool moves = false;
    for (auto& [id, thing] : things) {
      if (thing.over) continue;
      const auto its = std::find_if(truth.begin(), truth.end(),
                                    [&](const NumberedBox& one) { return one.id == id; });
      const bool stood = thing.life.standing_since() != kNoTime;
      const bool seen = its != truth.end();
      const ObjectBox around = seen ? its->box.wider(its->box.longer() / 2) : ObjectBox();
      const bool alone = std::none_of(truth.begin(), truth.end(), [&](const NumberedBox& one) {
        const auto other = things.find(one.id);
        return one.id != id && shared(one.box, around) > 0 &&
               (other == things.end() || other->second.life.moves());
      });
      if (seen)
        thing.life.follow({its->box, its->box, alone}, time, frame_time);
      else
        thing.life.miss(time, frame_time);
      const bool stands = thing.life.standing_since() != kNoTime;
      const auto tell = [&](Kind kind) {
        events.push_back(
            {kind, id, frame, kind == Kind::gone ? thing.life.last_whole() : thing.box});
      };
      if (!thing.appeared && frame >= options.settle_seconds * scene.rate && seen &&
          thing.life.appeared())
        thing.appeared = true, tell(Kind::appeared);
      if (seen) thing.seen = time;
      if (!thing.appeared) continue;
      if (seen) moves |= thing.life.moves();
      if (stood && !stands && (thing.stopped || thing.left))
        thing.stopped = thing.left = false, tell(Kind::moved_on);
      if (stands && !thing.stopped && !thing.left) {
        if (thing.life.came_by_itself())
          thing.stopped = true, tell(Kind::stopped);
        else if (thing.life.was_left())
          thing.left = true, tell(Kind::left_behind);
      }
      if (thing.life.gone()) thing.over = true, tell(Kind::gone);
    }
    moved = kNoTime;
    for (const auto& [id, thing] : things) {
      const int64_t since = thing.life.standing_since();
      if (thing.appeared) moved = std::max(moved, since == kNoTime ? thing.seen : since);
    }
    const TimedEvent of_all = {Kind::motion_begins, -1, frame, {}};
    if (moves && !in_motion) in_motion = true, events.push_back(of_all);
    if (in_motion && static_cast<double>(time - moved) >= options.grace_seconds * kSecond) {
      in_motion = false;
      events.push_back({Kind::motion_ends, -1, frame, {}});
    }
  }
  return events;
}

// The plain tracker: each box goes to the nearest region of the frame after it, one after the
// other, if that is nearer than its own longer side. What finds none ends.
class NearestBoxes {
 public:
  const std::vector<NumberedBox>& push(const std::vector<ObjectBox>& regions) {
    std::vector<NumberedBox> next;
    std::vector<char> taken(regions.size());
    for (const NumberedBox& box : boxes_) {
      int nearest = -1;
      for (size_t r = 0; r < regions.size(); ++r) {
        if (taken[r] || distance(box.box, regions[r]) > box.box.longer()) continue;
        if (nearest < 0 || distance(box.box, regions[r]) <
                               distance(box.box, regions[static_cast<size_t>(nearest)]))
          nearest = static_cast<int>(r);
      }
      if (nearest < 0) continue;
      taken[static_cast<size_t>(nearest)] = 1;
      next.push_back({box.id, regions[static_cast<size_t>(nearest)]});
    }
    for (size_t r = 0; r < regions.size(); ++r)
      if (!taken[r]) next.push_back({next_id_++, regions[r]});
    boxes_ = std::move(next);
    return boxes_;
  }

 private:
  std::vector<NumberedBox> boxes_;
  int64_t next_id_ = 1;
};

struct Row {
  std::map<Kind, EventScores> events;
  TrackingScores ours, plain;
  int64_t frames = 0;
  double mask_seconds = 0, region_seconds = 0, object_seconds = 0;
};

void score(const ObservedScene& scene, bool verbose, Row* row) {
  const ObjectOptions options;
  const double least_meta = scene.width * scene.height / 2000.0;
  ObjectTracker tracker;
  tracker.begin(scene.width, scene.height, options);
  NearestBoxes nearest;
  TrackingScores ours, plain;
  std::vector<TimedEvent> told;
  for (size_t k = 0; k < scene.frames.size(); ++k) {
    const ObservedFrame& frame = scene.frames[k];
    const auto begin = std::chrono::steady_clock::now();
    const auto& events = tracker.push({frame.regions, frame.removed, time_of(scene, k), 0});
    row->object_seconds += seconds_since(begin);
    for (const ObjectEvent& event : events)
      told.push_back({event.kind, event.object.id, static_cast<int>(k), event.object.box});
    std::vector<NumberedBox> found;
    for (const Object& object : tracker.objects())
      if (object.area >= least_meta) found.push_back({object.id, object.box});
    ours.add_frame(frame.truth, found);
    std::vector<ObjectBox> regions;
    for (const Region& r : frame.regions)
      if (r.area >= least_meta)
        regions.push_back({double(r.x), double(r.y), double(r.width), double(r.height)});
    plain.add_frame(frame.truth, nearest.push(regions));
  }
  ours.finish(), plain.finish();
  row->ours.add(ours), row->plain.add(plain);
  row->frames += std::ssize(scene.frames);
  row->mask_seconds += scene.mask_seconds, row->region_seconds += scene.region_seconds;
  const std::vector<TimedEvent> truth = true_events(scene, options);
  const auto true_box = [&](int64_t owner, int frame) -> const ObjectBox* {
    for (const NumberedBox& one : scene.frames[static_cast<size_t>(frame)].truth)
      if (one.id == owner) return &one.box;
    return nullptr;
  };
  const std::string name = scene.scene + " " + std::to_string(scene.seed);
  for (Kind kind : kKinds)
    row->events[kind].add(score_events(truth, told, true_box, kind,
                                       static_cast<int>(scene.frames.size()) - 1,
                                       verbose ? name.c_str() : nullptr));
}

double quantile(std::vector<int> of, double share) {
  if (of.empty()) return 0;
  std::sort(of.begin(), of.end());
  return of[static_cast<size_t>(share * static_cast<double>(of.size() - 1))];
}

void print(const std::map<std::string, Row>& rows) {
  std::printf(
      "| scene | event | true | in time | late | missed | median delay, frames | longest "
      "| false per 1000 frames |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [scene, row] : rows) {
    for (const auto& [kind, scores] : row.events)
      if (scores.true_events + scores.wrong > 0)
        std::printf("| %s | %s | %d | %d | %d | %d | %.0f | %.0f | %.2f |\n", scene.c_str(),
                    name_of(kind), scores.true_events, scores.in_time, scores.late, scores.missed,
                    quantile(scores.delays, 0.5), quantile(scores.delays, 1),
                    1000.0 * scores.wrong / static_cast<double>(row.frames));
    EventScores all;
    for (const auto& [kind, scores] : row.events) all.add(scores);
    std::printf("| **%s** | all | %d | %d | %d | %d | %.0f | %.0f | %.2f |\n", scene.c_str(),
                all.true_events, all.in_time, all.late, all.missed, quantile(all.delays, 0.5),
                quantile(all.delays, 1), 1000.0 * all.wrong / static_cast<double>(row.frames));
  }
  std::printf(
      "\n| scene | MOTA | IDF1 | switches | nearest box: MOTA | IDF1 | switches |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const auto& [scene, row] : rows)
    std::printf("| %s | %.3f | %.3f | %lld | %.3f | %.3f | %lld |\n", scene.c_str(),
                row.ours.mota(), row.ours.idf1(), static_cast<long long>(row.ours.switches()),
                row.plain.mota(), row.plain.idf1(), static_cast<long long>(row.plain.switches()));
}

void print_costs(const std::map<std::string, Row>& rows) {
  std::printf(
      "\n| scene | mask, ms a frame | regions | objects | share of the mask's time, %% |\n"
      "|---|---|---|---|---|\n");
  for (const auto& [scene, row] : rows) {
    const double ms = 1000 / static_cast<double>(row.frames);
    std::printf("| %s | %.3f | %.4f | %.4f | %.2f |\n", scene.c_str(), ms * row.mask_seconds,
                ms * row.region_seconds, ms * row.object_seconds,
                100 * (row.region_seconds + row.object_seconds) / row.mask_seconds);
  }
}

int run(int argc, char** argv) {
  CLI::App app("Follows things through simulated scenes and compares what is told with the truth.");
  std::vector<std::string> scenes = {"basic", "stop", "abandon", "remove", "clutter", "bootstrap"};
  int first = 0, seeds = 20, frames = 600;
  bool batch = false, truth = false, verbose = false, perfect = false;
  std::string keep, from;
  app.add_option("--scenes", scenes, "scenes, as qdmdscenesrc names them")->delimiter(' ');
  app.add_option("--first-seed", first, "seeds from this one on");
  app.add_option("--seeds", seeds, "how many seeds");
  app.add_option("--frames", frames, "of each scene");
  app.add_flag("--batch", batch, "mode=batch in place of live");
  app.add_flag("--true-masks", truth, "the scene's masks in place of the element's");
  app.add_flag("--verbose", verbose, "print each event that is missed, late or wrong");
  app.add_flag("--perfect", perfect, "fail where an event is missed, late or wrong");
  app.add_option("--keep", keep, "write what the masks showed to this file");
  app.add_option("--from", from, "take what masks showed from this file, and make none");
  CLI11_PARSE(app, argc, argv);
  const MasksOf masks = truth ? MasksOf::truth : batch ? MasksOf::batch : MasksOf::live;
  std::map<std::string, Row> rows;
  const auto is_wanted = [&](const ObservedScene& scene) {
    return std::find(scenes.begin(), scenes.end(), scene.scene) != scenes.end() &&
           static_cast<int>(scene.seed) >= first && static_cast<int>(scene.seed) < first + seeds;
  };
  if (!from.empty()) {
    std::ifstream in(from);
    ObservedScene scene;
    while (read(&in, &scene))
      if (is_wanted(scene)) score(scene, verbose, &rows[scene.scene]);
  } else {
    std::ofstream out;
    if (!keep.empty()) out.open(keep);
    for (const std::string& name : scenes)
      for (int seed = first; seed < first + seeds; ++seed) {
        const ObservedScene scene = observe(name, static_cast<uint64_t>(seed), frames, masks);
        if (!keep.empty()) write(scene, &out);
        score(scene, verbose, &rows[name]);
      }
  }
  print(rows);
  if (from.empty() && !truth) print_costs(rows);
  int wrong = 0;
  for (const auto& [scene, row] : rows)
    for (const auto& [kind, scores] : row.events)
      wrong += scores.late + scores.missed + scores.wrong;
  return rows.empty() || (perfect && wrong > 0) ? 1 : 0;
}

}  // namespace
}  // namespace qdmd::evaluation

int main(int argc, char** argv) { return qdmd::evaluation::run(argc, argv); }
