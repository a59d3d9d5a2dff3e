// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/runner.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "tests/evaluation/sheet.h"

namespace qdmd::evaluation {

namespace fs = std::filesystem;

namespace {

std::string file_name(std::string name) {
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

void write_png(const fs::path& path, const cv::Mat& picture) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", picture, bytes);
  write_atomically(path, bytes);
}

// What all methods of one sequence share. The clip is in memory from the first job that needs it
// to the last one's end.
struct Work {
  const Sequence* sequence;
  std::string key;
  std::mutex mutex;
  std::shared_ptr<const LabelledClip> clip;
  bool broken = false;
  size_t unfinished = 0;
  std::vector<std::optional<Row>> rows;  // by method
};

class Runner {
 public:
  Runner(const Plan& plan, Progress& progress)
      : plan_(plan), progress_(progress), work_(plan.sequences.size()) {
    for (size_t i = 0; i < work_.size(); ++i) {
      work_[i].sequence = &plan.sequences[i];
      work_[i].unfinished = plan.methods.size();
      work_[i].rows.resize(plan.methods.size());
      work_[i].key = key_of(plan.sequences[i]);
    }
  }

  std::vector<Row> run() {
    progress_.start(work_.size() * plan_.methods.size());
    {
      std::vector<std::jthread> workers;
      for (unsigned i = 0; i < plan_.jobs; ++i) workers.emplace_back([this] { take_jobs(); });
    }
    std::vector<Row> rows;
    for (const Work& work : work_)
      for (const auto& row : work.rows)
        if (row) rows.push_back(*row);
    return rows;
  }

 private:
  std::string key_of(const Sequence& sequence) const {
    std::string key = plan_.settings + sequence.name + "\n";
    for (const auto& frame : plan_.selection.of(sequence)) key += fingerprint(frame);
    if (!sequence.truth.empty()) key += fingerprint(sequence.truth);
    for (const auto& mask : sequence.masks) key += fingerprint(mask.second);
    if (!sequence.region.empty()) key += fingerprint(sequence.region);
    key += std::to_string(sequence.first_scored) + " " + std::to_string(sequence.last_scored);
    return key;
  }

  void take_jobs() {
    const size_t methods = plan_.methods.size();
    for (size_t job; (job = next_++) < work_.size() * methods;) {
      Work& work = work_[job / methods];
      const size_t m = job % methods;
      std::string outcome;
      try {
        outcome = do_job(work, *plan_.methods[m], &work.rows[m]);
      } catch (const std::exception& error) {
        progress_.problem(work.sequence->name, plan_.methods[m]->name() + ": " + error.what());
        outcome = "failed";
      }
      progress_.finish_job(work.sequence->name + " " + plan_.methods[m]->name() + " " + outcome);
      finish_job(work);
    }
  }

  // Says how it went.
  std::string do_job(Work& work, const Method& method, std::optional<Row>* out) {
    const std::string job = file_name(work.sequence->name) + "_" + method.name();
    const std::string key = work.key + method.name();
    if (const auto record = plan_.store.find(job, key); record && has_picture(job, *record)) {
      *out = record->row;
      return "done before";
    }
    const std::shared_ptr<const LabelledClip> clip = clip_of(work);
    if (!clip) return "skipped";

    const Task task{clip->frames, plan_.picture, !clip->labels.empty()};
    const Separation separation = method.separate(task);
    Record record;
    record.row = score(*clip, separation);
    record.row.sequence = work.sequence->name;
    record.row.method = method.name();
    record.background = digest(separation.background);
    if (!plan_.output_dir.empty())
      write_png(plan_.output_dir / (job + ".png"), separation.background);
    // A clip with a file left out is read again, so that this is said again.
    if (clip->problems.empty()) plan_.store.put(job, key, record);
    *out = record.row;
    char text[64];
    std::snprintf(text, sizeof text, "%.2f s", record.row.seconds);
    return text;
  }

  bool has_picture(const std::string& job, const Record& record) const {
    if (plan_.output_dir.empty()) return true;
    const cv::Mat picture = cv::imread((plan_.output_dir / (job + ".png")).string());
    return !picture.empty() && digest(picture) == record.background;
  }

  std::shared_ptr<const LabelledClip> clip_of(Work& work) {
    const std::lock_guard lock(work.mutex);
    if (work.broken || work.clip) return work.clip;
    try {
      work.clip = std::make_shared<LabelledClip>(read_clip(*work.sequence, plan_.selection));
      for (const auto& what : work.clip->problems) progress_.problem(work.sequence->name, what);
    } catch (const std::exception& error) {
      work.broken = true;
      progress_.problem(work.sequence->name, error.what());
    }
    return work.clip;
  }

  static Row score(const LabelledClip& clip, const Separation& separation) {
    Row row;
    row.frames = clip.frames.size();
    row.seconds = separation.seconds;
    if (!clip.truth.empty())
      row.picture = score_picture(view_of(separation.background), view_of(clip.truth));
    MaskCounts counts;
    for (size_t i = 0; i < separation.masks.size(); ++i)
      clip.score(i, separation.masks[i].data, &counts);
    if (!separation.masks.empty()) {
      row.precision = counts.precision();
      row.recall = counts.recall();
      row.f = counts.f_measure();
    }
    return row;
  }

  void finish_job(Work& work) {
    const std::lock_guard lock(work.mutex);
    if (--work.unfinished > 0) return;
    work.clip.reset();
    if (plan_.output_dir.empty()) return;
    try {
      write_sheet(work);
    } catch (const std::exception& error) {
      progress_.problem(work.sequence->name, std::string("contact sheet: ") + error.what());
    }
  }

  // From the pictures on disk, which are there whether this run or one before made them.
  void write_sheet(const Work& work) const {
    const std::string name = file_name(work.sequence->name);
    std::vector<Panel> panels;
    for (const auto& row : work.rows) {
      if (!row) continue;
      char score[32] = "";
      if (row->picture) std::snprintf(score, sizeof score, "  AGE %.2f", row->picture->age);
      panels.push_back(
          {row->method + score,
           cv::imread((plan_.output_dir / (name + "_" + row->method + ".png")).string())});
    }
    if (panels.empty()) return;
    const auto frames = plan_.selection.of(*work.sequence);
    const cv::Mat input =
        cv::imread(frames[scored_frame(plan_.picture, frames.size())].string(), cv::IMREAD_COLOR);
    cv::Mat truth;
    if (!work.sequence->truth.empty()) truth = cv::imread(work.sequence->truth.string());
    if (truth.size() != input.size()) truth.release();
    write_png(plan_.output_dir / (name + "_sheet.png"), contact_sheet(input, truth, panels));
  }

  const Plan& plan_;
  Progress& progress_;
  std::vector<Work> work_;
  std::atomic<size_t> next_ = 0;
};

}  // namespace

std::vector<Row> run(const Plan& plan, Progress& progress) { return Runner(plan, progress).run(); }

}  // namespace qdmd::evaluation
