// qdmd-archive: backgrounds, masks and foregrounds of recordings whose window no machine holds.
#include <gst/gst.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <new>

#include "examples/archive/job.h"

namespace {

using namespace qdmd;
using namespace qdmd::archive;

template <typename T>
using Names = std::map<std::string, T>;

// The element's names.
const Names<Method> kMethods{
    {"qdmd", Method::qdmd}, {"dmd", Method::dmd}, {"robust", Method::robust}};
const Names<Amplitude> kAmplitudes{{"window", Amplitude::window},
                                   {"first-frame", Amplitude::first_frame}};
const Names<Solver> kSolvers{
    {"auto", Solver::automatic}, {"gram", Solver::gram}, {"gram-extended", Solver::gram_extended}};
const Names<Estimator> kEstimators{{"exact", Estimator::exact},
                                   {"forward-backward", Estimator::forward_backward},
                                   {"total", Estimator::total},
                                   {"optimized", Estimator::optimized}};
const Names<Shadows> kShadows{{"background", Shadows::background},
                              {"foreground", Shadows::foreground},
                              {"marked", Shadows::marked}};

struct Paths {
  std::string background, mask, foreground, cutout;
};

template <typename T>
CLI::Option* add_choice(CLI::App& app, const char* name, T* value, const Names<T>& names,
                        const char* help) {
  std::string now;
  for (const auto& [text, of_name] : names)
    if (of_name == *value) now = text;
  return app
      .add_option_function<std::string>(
          name, [value, &names](const std::string& text) { *value = names.at(text); }, help)
      ->check(CLI::IsMember(&names))
      ->default_str(now);
}

void declare(CLI::App& app, JobOptions& options, Paths& paths) {
  EngineOptions& engine = options.engine;
  app.add_option("recording", options.recordings,
                 "Files that are one recording, in this order; or a folder of pictures (PNG or "
                 "JPEG), in the order of their names")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--background", paths.background,
                 "Backgrounds: .png, a picture of each window (-2, -3 .. after the first's name), "
                 "or .mkv, a video of each frame's");
  app.add_option("--mask", paths.mask, "Video of the masks, .mkv");
  app.add_option("--foreground", paths.foreground, "Video of the foreground, .mkv");
  app.add_option("--cutout", paths.cutout, "Video of the frames where the mask is set, .mkv");
  app.add_option("--window,--window-size", engine.window_size,
                 "Frames that are decomposed together")
      ->check(CLI::Range(EngineOptions::kMinWindow, EngineOptions::kMaxWindow))
      ->capture_default_str();
  add_choice(app, "--method", &engine.method, kMethods, "How a window is decomposed");
  app.add_option("--rank", engine.dmd.rank,
                 "Singular values that are kept (0: all for qdmd and dmd, 1 for robust)")
      ->check(CLI::Range(0, EngineOptions::kMaxWindow))
      ->capture_default_str();
  app.add_option("--omega-threshold", engine.dmd.omega_threshold,
                 "Modes at most so far from the origin, in rad/frame, are background (0: the "
                 "nearest)")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_choice(app, "--amplitude", &engine.dmd.amplitude, kAmplitudes,
             "Which frames decide how strong the background mode is");
  add_choice(app, "--solver", &engine.dmd.solver, kSolvers,
             "How the decomposition is computed; those that read pixels need one machine");
  add_choice(app, "--estimator", &engine.dmd.estimator, kEstimators,
             "How eigenvalues are estimated from frames with noise");
  app.add_option("--sample-step", engine.sample_step,
                 "The decomposition sees every k-th pixel in x and y (0: chosen)")
      ->check(CLI::Range(0, EngineOptions::kMaxSampleStep))
      ->capture_default_str();
  app.add_option("--iterations", engine.iterations, "Of robust")
      ->check(CLI::Range(1, EngineOptions::kMaxIterations))
      ->capture_default_str();
  app.add_option("--foreground-threshold", engine.foreground_threshold,
                 "Levels from the background above which a pixel is foreground (0: from the noise)")
      ->check(CLI::Range(0.0, 442.0))
      ->capture_default_str();
  app.add_option("--absorb-time", options.absorb_time,
                 "Seconds that something which came and stands still is foreground (0: for ever)")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  add_choice(app, "--shadows", &options.shadows, kShadows,
             "What masks make of the background in another light");
  app.add_option("--n-threads", engine.threads,
                 "Threads of each process (0: one for each core); start a process a core instead, "
                 "or one a machine with all its cores where memory is short")
      ->check(CLI::Range(0, EngineOptions::kMaxThreads))
      ->capture_default_str();
  app.add_option("--max-memory", engine.max_memory, "Bytes that each process may take")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--framerate", options.rate, "Of pictures, frames a second")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  app.add_option("--encoder", options.encoder,
                 "Elements of GStreamer that make a file of raw video; the default loses nothing")
      ->capture_default_str();
  app.add_flag("--resume", options.resume, "Go on after the last window that was written");
  app.add_option("--report", options.report,
                 "Write what each process took in memory, time and bytes a frame, as JSON, to this "
                 "file (-: to standard output)");
  app.add_flag("--quiet", options.quiet, "Say nothing but errors");
}

std::vector<Wanted> wanted_of(const Paths& paths) {
  std::vector<Wanted> wanted;
  const auto add = [&](Output output, const std::string& path) {
    if (!path.empty()) wanted.push_back({output, path});
  };
  add(Output::background, paths.background);
  add(Output::mask, paths.mask);
  add(Output::foreground, paths.foreground);
  add(Output::cutout, paths.cutout);
  return wanted;
}

// What all processes find alike is said once.
int fail(const MpiTeam* team, const char* what, bool alike) {
  if (!team || !alike) {
    std::fprintf(stderr, "qdmd-archive%s: %s\n",
                 team ? (" (process " + std::to_string(team->rank()) + ")").c_str() : "", what);
  } else if (team->rank() == 0) {
    std::fprintf(stderr, "qdmd-archive: %s\n", what);
  }
  std::fflush(stderr);
  // The others wait for this one.
  if (team && !alike) MpiTeam::abort();
  return alike ? 2 : 1;
}

// The C library gives the memory of frames back to the system when they are freed, as blocks or
// from the end of its heap: each frame is new memory then, which can take longer than the window's
// mathematics. With one of both limits it is worse than with none. One heap, because a frame is
// freed by another thread than took it.
void keep_memory_of_frames() {
#ifdef __GLIBC__
  // More than a frame of 8K has; versions before 2.35 take less.
  if (!mallopt(M_MMAP_THRESHOLD, 1 << 28) && !mallopt(M_MMAP_THRESHOLD, 1 << 25)) return;
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_ARENA_MAX, 1);
#endif
}

}  // namespace

// Ends with 0; 1 where something failed; 2 where options are wrong.
int main(int argc, char** argv) {
  keep_memory_of_frames();
  std::unique_ptr<MpiTeam> team;
  try {
    if (MpiTeam::is_job()) team = std::make_unique<MpiTeam>(&argc, &argv);
    gst_init(nullptr, nullptr);
    JobOptions options;
    options.engine.threads = 1;
    options.engine.max_memory = UINT64_MAX;
    Paths paths;
    CLI::App app(
        "Separates background and foreground of recordings, window by window. The processes of an "
        "MPI job share each window: mpirun -n 8 qdmd-archive ...");
    declare(app, options, paths);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      // What only some find is no matter of options.
      const bool alike = !team || team->agree(true) == 2;
      if (alike && team && team->rank() > 0) return error.get_exit_code() == 0 ? 0 : 2;
      const int status = app.exit(error) == 0 ? 0 : 2;
      if (!alike) MpiTeam::abort();
      return status;
    }
    // Somebody is about to end the job.
    if (team && team->agree(false) != 0) team->wait_for_all();
    options.wanted = wanted_of(paths);
    run_job(options, team.get());
    return 0;
  } catch (const std::invalid_argument& error) {
    return fail(team.get(), error.what(), true);
  } catch (const std::bad_alloc&) {
    return fail(team.get(),
                "not enough memory for the window: start more processes, lower --window, or scale "
                "the video down",
                false);
  } catch (const std::exception& error) {
    return fail(team.get(), error.what(), false);
  }
}
