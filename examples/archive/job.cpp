#include "examples/archive/job.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "examples/archive/files.h"
#include "examples/archive/frame_reader.h"
#include "examples/archive/picture.h"
#include "examples/archive/progress_line.h"
#include "gst/videoformat.h"

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

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
  const EngineOptions& engine = options.engine;
  text << "method " << static_cast<int>(engine.method) << " window " << engine.window_size
       << " rank " << engine.dmd.rank << " omega-threshold " << engine.dmd.omega_threshold
       << " amplitude " << static_cast<int>(engine.dmd.amplitude) << " solver "
       << static_cast<int>(engine.dmd.solver) << " estimator "
       << static_cast<int>(engine.dmd.estimator) << " sample-step " << engine.sample_step
       << " iterations " << engine.iterations << " foreground-threshold "
       << engine.foreground_threshold << " shadows " << static_cast<int>(options.shadows)
       << " absorb-time " << options.absorb_time << " rate " << options.rate << " encoder "
       << options.encoder << " in the recording's colours";
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

class Job {
 public:
  Job(const JobOptions& options, MpiTeam* team)
      : options_(options),
        team_(team),
        reader_(options.recordings, options.rate,
                [this](const RecordingInfo& info) { return choose(info); }),
        line_(options.quiet || !writes()) {
    progress_path_ = progress_of(options.wanted.front().path);
    engine_options_ = options.engine;
    engine_options_.shadows = options.shadows;
    engine_options_.team = team;
    engine_options_.remembers = false;
    done_.settings = settings_of(options);
    if (writes()) check_report(options.report);
    if (options.resume) go_on();
  }

  void run() {
    // Nobody reads what the first process is about to write.
    if (team_) team_->wait_for_all();
    if (!done_.ended) read_all();
    if (writes()) finish();
    if (writes() && !options_.quiet)
      for (const std::string& sentence : reader_.early_ends())
        std::fprintf(stderr, "qdmd-archive: %s\n", sentence.c_str());
    if (team_) team_->wait_for_all();
    report();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  }

  // Where an earlier job stopped. The first process has its files.
  void go_on() {
    if (writes()) {
      const auto before = read_progress(progress_path_);
      if (before && before->settings != done_.settings)
        throw std::runtime_error(progress_path_ +
                                 " is of a job with other options: give the same ones, or leave "
                                 "--resume out to begin anew");
      if (before) done_ = *before;
    }
    if (!team_) return;
    int64_t values[] = {done_.windows, done_.frames, done_.ended};
    team_->tell(values);
    done_.windows = values[0];
    done_.frames = values[1];
    done_.ended = values[2] != 0;
  }

  bool writes() const { return !team_ || team_->rank() == 0; }
  int64_t window_size() const { return engine_options_.window_size; }
  const Band& band() const { return engine_.plan().band(); }

  // From the streaming thread, before there is a frame.
  Rows choose(const RecordingInfo& info) {
    EngineOptions options = engine_options_;
    set_format(info.picture, &options);
    const EnginePlan plan(options, info.width, info.height);
    if (!plan.status().ok()) throw std::invalid_argument(plan.status().message);
    return {plan.band().first(), plan.band().rows()};
  }

  bool next_frame() {
    const auto start = Clock::now();
    const bool some = reader_.next();
    reading_ += since(start);
    return some;
  }

  // With each window, not with each frame: processes need not decode in step.
  void agree_on(int64_t read) {
    if (!team_) return;
    int64_t first[] = {read};
    team_->tell(first);
    if (team_->agree(first[0] != read) != 0)
      throw std::runtime_error(
          "processes find another number of frames in the recording, this one " +
          std::to_string(read) + ": do all machines have the same files?");
  }

  void configure() {
    const RecordingInfo& info = reader_.info();
    if (team_) {
      const int64_t own[] = {info.width, info.height, GST_VIDEO_INFO_FORMAT(&info.picture)};
      int64_t first[] = {own[0], own[1], own[2]};
      team_->tell(first);
      if (team_->agree(!std::equal(own, std::end(own), first)) != 0)
        throw std::runtime_error("processes read different frames, this one " +
                                 std::to_string(info.width) + "x" + std::to_string(info.height) +
                                 " in " + GST_VIDEO_INFO_NAME(&info.picture) +
                                 ": do all machines have the same files?");
    }
    engine_options_.frame_rate = 0;
    set_format(info.picture, &engine_options_);
    const Status status = engine_.configure(engine_options_, info.width, info.height);
    if (!status.ok()) throw std::invalid_argument(status.message);
    wishes_ = first_wishes(engine_options_);
    if (options_.absorb_time > 0)
      wishes_.absorb_frames =
          static_cast<int64_t>(std::clamp(std::round(options_.absorb_time * info.rate), 1.0, 1e12));
    wishes_.masks_expected = wants_masks();
    picture_.emplace(info.picture, band().rows(), writes());
    mask_.emplace(mask_info(info.picture), band().rows(), writes());
    outputs_.emplace(options_.wanted, info.picture, info.rate, options_.encoder);
    if (!writes()) return;
    // Nobody goes on with what another job had done.
    if (!options_.resume) fs::remove(progress_path_);
    outputs_->begin_after(done_.windows);
  }

  bool wants_masks() const {
    return std::any_of(options_.wanted.begin(), options_.wanted.end(), [](const Wanted& one) {
      return one.output == Output::mask || one.output == Output::cutout;
    });
  }

  void read_all() {
    // If the recording ends early in a window, that window has frames of the one before it.
    const int64_t first = std::max<int64_t>(0, done_.frames - window_size());
    int64_t read = 0;
    std::vector<GstClockTime> times;
    while (next_frame()) {
      if (++read <= first) continue;
      if (!engine_.configured()) {
        if (team_) team_->all_have(true);
        configure();
        line_.begin(reader_.share());
      }
      const auto start = Clock::now();
      check(engine_.push(reader_.view(), &wishes_));
      pushing_ += since(start);
      times.push_back(reader_.time());
      line_.show(reader_.share(), read, done_.windows + 1);
      if (static_cast<int64_t>(times.size()) == window_size()) end_window(&times, read);
    }
    if (!times.empty()) end_window(&times, read);
    if (team_ && !engine_.configured()) team_->all_have(false);
    agree_on(read);
    if (read == 0) throw std::runtime_error("the recording has no frame");
    frames_ = read - std::min(first, read);
    done_.ended = true;
    if (read < done_.frames)
      throw std::runtime_error("the recording has fewer frames than were finished already");
    if (!writes()) return;
    const auto end = Clock::now();
    if (outputs_) outputs_->wait();
    encoding_ += since(end);
    write_progress(progress_path_, done_);
  }

  void check(const Status& status) const {
    if (!status.ok()) throw std::runtime_error(status.message);
  }

  // Writes what a window gives, unless that was done before.
  void end_window(std::vector<GstClockTime>* times, int64_t read) {
    agree_on(read);
    const auto start = Clock::now();
    check(engine_.drain());
    solving_ += since(start);
    const bool known = read <= done_.frames;
    for (GstClockTime time : *times) {
      if (!known) write_frame(time);
      engine_.next()->skip();
    }
    if (!known) {
      write_background();
      ++done_.windows;
      done_.frames = read;
      const auto end = Clock::now();
      if (writes())
        outputs_->end_window([path = progress_path_, done = done_] { write_progress(path, done); });
      encoding_ += since(end);
      note_solve();
    }
    engine_.begin_anew();
    times->clear();
  }

  void note_solve() {
    const SolveReport report = engine_.report().solve;
    solves_.push_back({{"frames", report.window_frames},
                       {"rank", report.dmd.rank},
                       {"lambda", {report.dmd.lambda.real(), report.dmd.lambda.imag()}},
                       {"omega", report.dmd.omega},
                       {"noise", report.foreground.noise},
                       {"foreground-ratio", report.foreground.ratio}});
  }

  void write_frame(GstClockTime time) {
    for (size_t which = 0; which < options_.wanted.size(); ++which) {
      const Wanted& wanted = options_.wanted[which];
      if (wanted.is_picture()) continue;
      if (wanted.output == Output::mask && options_.shadows != Shadows::marked) {
        const auto start = Clock::now();
        const uint8_t* const mask = engine_.next()->whole_mask();
        if (writes()) mask_->whole->copy(mask);
        pictures_ += since(start);
        if (writes()) encode(which, mask_->whole->all(), time);
        continue;
      }
      const bool is_mask = wanted.output == Output::mask;
      Shared& shared = is_mask ? *mask_ : *picture_;
      const auto start = Clock::now();
      engine_.next()->write(wanted.output, is_mask ? Levels() : engine_options_.levels,
                            shared.kept.view());
      pictures_ += since(start);
      gather(&shared);
      if (writes()) encode(which, shared.whole->all(), time);
    }
  }

  void encode(size_t which, std::span<const uint8_t> picture, GstClockTime time) {
    const auto start = Clock::now();
    outputs_->write(which, done_.windows, picture, time);
    encoding_ += since(start);
  }

  void write_background() {
    for (size_t which = 0; which < options_.wanted.size(); ++which) {
      if (!options_.wanted[which].is_picture()) continue;
      engine_.write_background(picture_->kept.view());
      gather(&*picture_);
      if (!writes()) continue;
      const auto start = Clock::now();
      outputs_->write_picture(which, done_.windows, picture_->whole->all());
      encoding_ += since(start);
    }
  }

  // A picture: the rows that this process keeps; and, at the first process, all of it.
  struct Shared {
    Picture kept;
    std::optional<Picture> whole;

    Shared(const GstVideoInfo& info, int rows, bool first)
        : kept(info, GST_VIDEO_INFO_WIDTH(&info), rows) {
      if (first) whole.emplace(info, GST_VIDEO_INFO_WIDTH(&info), GST_VIDEO_INFO_HEIGHT(&info));
    }
  };

  // Each process has written its own rows.
  void gather(Shared* shared) {
    const Band& band = this->band();
    const int first = band.own_begin(), end = first + band.own_rows();
    for (int plane = 0; plane < shared->kept.planes(); ++plane) {
      const std::span<const uint8_t> own = shared->kept.rows(plane, first, end);
      std::span<uint8_t> whole;
      if (writes()) whole = shared->whole->rows(plane, 0, band.height());
      if (!team_) {
        std::copy(own.begin(), own.end(), whole.begin());
        continue;
      }
      std::vector<size_t> ends;
      for (int rank = 0; rank < band.members(); ++rank)
        ends.push_back(shared->kept.bytes_before(plane, band.end_of(rank)));
      team_->gather(own, whole, ends);
    }
  }

  // The first process only.
  void finish() {
    const auto start = Clock::now();
    line_.say("joining the windows' videos");
    if (!outputs_) {
      const RecordingInfo info;
      outputs_.emplace(options_.wanted, info.picture, info.rate, options_.encoder);
    }
    // Killed before this is known, the job joins all of them once more.
    if (!done_.joined) {
      outputs_->join(done_.windows);
      done_.joined = true;
      write_progress(progress_path_, done_);
    }
    outputs_->remove_parts();
    fs::remove(progress_path_);
    encoding_ += since(start);
    line_.end();
  }

  // The values of all processes, by the first.
  std::vector<double> of_all(double value) const {
    return team_ ? team_->collect(value) : std::vector<double>{value};
  }

  void report() {
    if (options_.report.empty()) return;
    rusage usage = {};
    getrusage(RUSAGE_SELF, &usage);
    Json processes;
    const auto add = [&](const char* name, double value) {
      const std::vector<double> values = of_all(value);
      if (writes()) processes[name] = values;
    };
    const double all = since(begin_);
    add("seconds", all);
    add("seconds-reading", reading_);
    add("seconds-taking", pushing_);
    add("seconds-solving", solving_);
    add("seconds-pictures", pictures_);
    add("seconds-encoding", encoding_);
    add("seconds-talking", team_ ? team_->seconds() : 0);
    const auto in_seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    // The time of all threads, but for what is spent on waiting for others.
    add("processor-seconds", in_seconds(usage.ru_utime) + in_seconds(usage.ru_stime) -
                                 (team_ ? team_->processor_seconds() : 0));
    add("most-memory", static_cast<double>(usage.ru_maxrss) * 1024);
    add("page-faults", static_cast<double>(usage.ru_minflt));
    add("rows", engine_.configured() ? band().own_rows() : 0);
    add("rows-kept", engine_.configured() ? band().rows() : 0);
    const auto frames = static_cast<double>(std::max<int64_t>(frames_, 1));
    Json bytes;
    for (size_t i = 0; team_ && i < kTraffic; ++i) {
      const auto traffic = static_cast<Traffic>(i);
      const std::vector<double> values =
          team_->collect(static_cast<double>(team_->received(traffic)) / frames);
      if (writes()) bytes[name_of(traffic)] = values;
    }
    if (!writes()) return;
    const RecordingInfo& info = reader_.info();
    const Json json = {{"size", {info.width, info.height}},
                       {"frames", frames_},
                       {"windows", done_.windows},
                       {"processes", team_ ? team_->size() : 1},
                       {"of-process", processes},
                       {"bytes-received-a-frame", bytes},
                       {"solves", solves_}};
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
  MpiTeam* team_;
  EngineOptions engine_options_;
  Clock::time_point begin_ = Clock::now();
  FrameReader reader_;
  ProgressLine line_;
  Engine engine_;
  Wishes wishes_;
  std::optional<Outputs> outputs_;
  std::string progress_path_;
  Progress done_;
  int64_t frames_ = 0;
  std::optional<Shared> picture_, mask_;
  Json solves_ = Json::array();
  double reading_ = 0, pushing_ = 0, solving_ = 0, pictures_ = 0, encoding_ = 0;
};

}  // namespace

void run_job(const JobOptions& options, MpiTeam* team) {
  check_wanted(options.wanted, options.recordings, options.report);
  for (double number : {options.engine.dmd.omega_threshold, options.engine.foreground_threshold,
                        options.absorb_time, options.rate})
    if (!std::isfinite(number))
      throw std::invalid_argument(
          "--omega-threshold, --foreground-threshold, --absorb-time and --framerate are finite "
          "numbers");
  Job(options, team).run();
}

}  // namespace qdmd::archive
