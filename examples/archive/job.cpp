// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/job.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "examples/archive/element_options.h"
#include "examples/archive/gst_pointers.h"
#include "examples/archive/job_folder.h"
#include "examples/archive/launch.h"
#include "examples/archive/progress_line.h"

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

// Names of files may have any bytes, and JSON has none but those of a text.
std::string as_text(const std::string& name) {
  std::string text;
  for (const char letter : name) {
    char code[4];
    std::snprintf(code, sizeof code, "%%%02X", static_cast<unsigned char>(letter));
    const bool plain = letter >= ' ' && letter < 127 && letter != '%';
    text += plain ? std::string(1, letter) : code;
  }
  return text;
}

// What the files depend on, but not how many processes write them.
std::string settings_of(const JobOptions& options) {
  std::ostringstream text;
  text.precision(17);
  text << "rate " << options.rate << " encoder " << options.encoder << " stretch "
       << options.stretch << " warm-up " << options.warm_up;
  for (const auto& [name, value] : options.properties)
    if (name != "n-threads" && name != "max-memory") text << " " << name << " " << as_text(value);
  for (const std::string& path : options.recordings)
    text << " from " << as_text(fs::absolute(path).string());
  for (const Wanted& wanted : options.wanted)
    text << " to " << static_cast<int>(wanted.output) << " "
         << as_text(fs::absolute(wanted.path).string());
  return text.str();
}

// That somebody can write there; nobody wants to hear it at the end.
void check_report(const std::string& path) {
  if (path.empty() || path == "-") return;
  // A pipe may have no reader yet.
  const bool is_other = fs::exists(path) && !fs::is_regular_file(path) && !fs::is_directory(path);
  if (!is_other && !std::ofstream(path, std::ios::app))
    throw std::runtime_error(path + " cannot be written");
}

double processor_seconds() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  const auto in_seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return in_seconds(usage.ru_utime) + in_seconds(usage.ru_stime);
}

double most_memory() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024;
}

class Job {
 public:
  Job(const JobOptions& options, const Ranks& ranks)
      : options_(options),
        ranks_(ranks),
        folder_(options.wanted.front().path),
        shows_(!is_child() && (ranks.rank == 0 || options.parts > 0)),
        line_(options.quiet || !shows_) {}

  int run(char** argv) {
    if (options_.join) {
      plan_ = known_plan();
      if (const int64_t left = stretches_left(); left > 0)
        throw std::runtime_error(std::to_string(left) + " of " +
                                 std::to_string(plan_.stretches.size()) +
                                 " stretches are not done yet");
      join();
      return 0;
    }
    begin();
    if (!plan_.joined) {
      line_.begin(share());
      if (options_.jobs > 1) {
        const int status = run_processes(options_.jobs, argv, [this] { show(); });
        if (status != 0) return status;
      } else {
        work();
      }
    }
    const int64_t left = plan_.joined || folder_gone() ? 0 : stretches_left();
    if (left == 0)
      join();
    else if (!options_.quiet)
      std::fprintf(stderr, "part %d of %d is done: %lld of %zu stretches are left to others\n",
                   options_.part, options_.parts, static_cast<long long>(left),
                   plan_.stretches.size());
    return 0;
  }

  // As a process that another one started.
  void run_child() {
    plan_ = known_plan();
    work();
  }

 private:
  Plan known_plan() {
    auto plan = folder_.read_plan();
    if (!plan) throw std::runtime_error(folder_.path() + " has no plan: begin anew");
    check_settings(*plan);
    return *plan;
  }

  void check_settings(const Plan& plan) const {
    if (plan.settings != settings_of(options_))
      throw std::runtime_error(folder_.path() +
                               " is of a job with other options: give the same ones, or remove it "
                               "(or leave --resume out) to begin anew");
  }

  bool folder_gone() const { return !fs::exists(folder_.path()); }

  // The plan: of the first process, for all.
  void begin() {
    if (ranks_.rank > 0 && options_.parts == 0) return wait_for_plan();
    check_report(options_.report);
    const LockedFile held = folder_.hold();
    std::optional<Plan> before;
    if (options_.resume || options_.parts > 0) before = folder_.read_plan();
    if (before) {
      check_settings(*before);
      plan_ = std::move(*before);
      std::vector<size_t> whole;
      for (size_t i = 0; i < plan_.stretches.size(); ++i)
        if (folder_.facts(i)) whole.push_back(i);
      if (!plan_.joined) check_parts(options_.wanted, whole);
    } else {
      folder_.clear();
      try {
        begin_anew();
      } catch (...) {
        folder_.remove();
        throw;
      }
    }
    plan_.job = ranks_.job;
    folder_.write_plan(plan_);
  }

  void begin_anew() {
    plan_ = make_plan({options_.recordings, options_.rate, options_.window, options_.stretch,
                       options_.warm_up,
                       (options_.parts > 0 ? options_.parts : ranks_.size) * options_.jobs});
    plan_.settings = settings_of(options_);
    begin_parts(options_.wanted);
    if (options_.quiet) return;
    for (const std::string& sentence : plan_.early_ends)
      std::fprintf(stderr, "qdmd-archive: %s\n", sentence.c_str());
  }

  void wait_for_plan() {
    // From when on nobody makes one.
    Clock::time_point idle = Clock::now();
    for (;;) {
      auto plan = folder_.read_plan();
      if (plan && plan->job == ranks_.job) {
        plan_ = std::move(*plan);
        return;
      }
      if (!folder_gone() && !folder_.hold_to_join()) idle = Clock::now();
      // The others may have done it all.
      if (Clock::now() - idle > std::chrono::seconds(60)) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
  }

  bool is_mine(size_t index) const {
    return options_.parts == 0 ||
           static_cast<int>(index % static_cast<size_t>(options_.parts)) == options_.part - 1;
  }

  int64_t stretches_left() {
    int64_t left = 0;
    for (size_t i = 0; i < plan_.stretches.size(); ++i) left += !folder_.facts(i);
    return left;
  }

  // Takes the next stretch that is free until all are whole.
  void work() {
    for (;;) {
      bool others = false;
      for (size_t i = 0; i < plan_.stretches.size(); ++i) {
        if (!is_mine(i) || folder_.facts(i)) continue;
        auto held = folder_.take(i);
        // It may have become whole meanwhile.
        if (held && !folder_.facts(i))
          do_stretch(i, &*held);
        else
          others = others || !held;
      }
      if (!others || folder_gone()) return;
      // Where another process dies, its stretch is free.
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      show();
    }
  }

  void do_stretch(size_t index, LockedFile* held) {
    const Clock::time_point begin = Clock::now();
    const double processor = processor_seconds();
    Clock::time_point told = begin;
    const int64_t frames = separate(options_, plan_, index, [&](int64_t written) {
      if (Clock::now() - told < std::chrono::seconds(1)) return;
      told = Clock::now();
      held->write(std::to_string(written));
      show();
    });
    folder_.finish(index, {frames, plan_.stretches[index].warm_up,
                           std::chrono::duration<double>(Clock::now() - begin).count(),
                           processor_seconds() - processor, most_memory()});
  }

  double share() {
    const auto all = static_cast<double>(std::max<int64_t>(plan_.frames, 1));
    return std::min(static_cast<double>(folder_.frames_done(plan_.stretches.size())) / all, 1.0);
  }

  void show() {
    if (shows_ && line_.is_time())
      line_.show(share(), folder_.frames_done(plan_.stretches.size()), plan_.frames);
  }

  // By the process that comes first; the others have nothing to do.
  void join() {
    const auto held = folder_.hold_to_join();
    if (!held) return;
    auto plan = folder_.read_plan();
    if (!plan) return;
    plan_ = std::move(*plan);
    const Clock::time_point begin = Clock::now();
    std::vector<size_t> stretches;
    Json facts = Json::array();
    int64_t frames = 0;
    for (size_t i = 0; i < plan_.stretches.size(); ++i) {
      const auto known = folder_.facts(i);
      if (!known) continue;
      if (known->frames > 0) stretches.push_back(i);
      frames += known->frames;
      facts.push_back({{"frames", known->frames},
                       {"warm-up", known->warm_up},
                       {"seconds", known->seconds},
                       {"processor-seconds", known->processor_seconds},
                       {"most-memory", known->most_memory}});
    }
    // Killed before this is known, the job joins all of them once more.
    if (!plan_.joined) {
      line_.say("joining the stretches' videos");
      if (frames == 0) throw std::runtime_error("the recording has no frame");
      join_parts(options_.wanted, stretches);
      plan_.joined = true;
      folder_.write_plan(plan_);
    }
    remove_parts(options_.wanted);
    report({{"frames", frames},
            {"stretches", facts},
            {"seconds-joining", std::chrono::duration<double>(Clock::now() - begin).count()}});
    folder_.remove();
    line_.end();
  }

  void report(const Json& json) const {
    if (options_.report.empty()) return;
    if (options_.report == "-") {
      std::printf("%s\n", json.dump(1).c_str());
      return;
    }
    std::ofstream file(options_.report);
    file << json.dump(1) << '\n';
    if (!file.flush())
      throw std::runtime_error(options_.report + " cannot be written: is the disk full?");
  }

  const JobOptions& options_;
  const Ranks ranks_;
  JobFolder folder_;
  Plan plan_;
  const bool shows_;
  ProgressLine line_;
};

}  // namespace

int run_job(const JobOptions& options, char** argv) {
  check_wanted(options.wanted, options.recordings, options.report);
  Job job(options, ranks_of_environment());
  if (!is_child()) return job.run(argv);
  job.run_child();
  return 0;
}

}  // namespace qdmd::archive
