// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/rows.h"
#include "examples/archive/gst_pointers.h"

#include <mpi.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/engine/engine.h"
#include "examples/archive/element_options.h"
#include "examples/archive/files.h"
#include "examples/archive/frame_reader.h"
#include "examples/archive/launch.h"
#include "examples/archive/video_writer.h"
#include "gst/videoformat.h"

namespace qdmd::archive {
namespace {

// MPI counts in int.
constexpr size_t kMost = size_t{1} << 27;

// The processes of the job; one alone starts no MPI.
class Processes {
 public:
  Processes(int* argc, char*** argv) : shared_(ranks_of_environment().size > 1) {
    if (!shared_) return;
    int provided = 0;
    if (MPI_Init_thread(argc, argv, MPI_THREAD_FUNNELED, &provided) != MPI_SUCCESS ||
        provided < MPI_THREAD_FUNNELED)
      throw std::runtime_error("this MPI cannot be used by a program with threads");
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  }
  ~Processes() {
    if (shared_) MPI_Finalize();
  }
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  int size() const { return size_; }
  int rank() const { return rank_; }

  // Each number becomes that of all processes, added up.
  void add(std::span<int64_t> values) const {
    for (size_t at = 0; shared_ && at < values.size(); at += kMost)
      MPI_Allreduce(MPI_IN_PLACE, values.data() + at,
                    static_cast<int>(std::min(kMost, values.size() - at)), MPI_INT64_T, MPI_SUM,
                    MPI_COMM_WORLD);
  }
  // The first process gets all rows, one after another.
  void gather(std::vector<uint8_t> own, std::vector<uint8_t>* all) const {
    if (!shared_) {
      *all = std::move(own);
      return;
    }
    const int count = static_cast<int>(own.size());
    std::vector<int> counts(static_cast<size_t>(size_)), offsets(counts.size());
    MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, MPI_COMM_WORLD);
    for (size_t i = 1; i < counts.size(); ++i) offsets[i] = offsets[i - 1] + counts[i - 1];
    if (rank_ == 0) all->resize(static_cast<size_t>(offsets.back() + counts.back()));
    MPI_Gatherv(own.data(), count, MPI_BYTE, all->data(), counts.data(), offsets.data(), MPI_BYTE,
                0, MPI_COMM_WORLD);
  }
  // The others wait for this one.
  [[noreturn]] void abort() const {
    // What starters have not forwarded yet of what was said, they drop.
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    MPI_Abort(MPI_COMM_WORLD, 1);
    std::_Exit(1);
  }

 private:
  bool shared_;
  int size_ = 1, rank_ = 0;
};

// The element's properties as the engine's options.
EngineOptions engine_options(const JobOptions& options) {
  GstElement* const element = make_element(options.properties);
  gint method = 0, amplitude = 0, solver = 0, estimator = 0;
  guint window = 0, rank = 0, step = 0, threads = 0;
  EngineOptions engine;
  gchar* folder = nullptr;
  g_object_get(element, "method", &method, "amplitude", &amplitude, "solver", &solver, "estimator",
               &estimator, "window-size", &window, "rank", &rank, "sample-step", &step, "n-threads",
               &threads, "max-memory", &engine.max_memory, "omega-threshold",
               &engine.dmd.omega_threshold, "window-on-disk", &folder, nullptr);
  gst_object_unref(element);
  if (const CharsPtr own(folder); own) engine.window_on_disk = own.get();
  engine.method = static_cast<Method>(method);
  engine.dmd.amplitude = static_cast<Amplitude>(amplitude);
  engine.dmd.solver = static_cast<Solver>(solver);
  engine.dmd.estimator = static_cast<Estimator>(estimator);
  engine.dmd.rank = static_cast<int>(rank);
  engine.window_size = static_cast<int>(window);
  engine.sample_step = static_cast<int>(step);
  engine.threads = static_cast<int>(threads);
  return engine;
}

// Rows of a frame or of a picture.
template <typename View>
View rows_of(View view, int first, int count) {
  for (int c = 0; c < 3; ++c) {
    const Spacing at = view.spacing(c);
    view.channel[c] += first / at.rows * at.row_stride;
  }
  if (view.alpha) view.alpha += first * view.spacing(3).row_stride;
  view.height = count;
  return view;
}

class Windows {
 public:
  Windows(const JobOptions& options, const Processes& processes)
      : options_(options), processes_(processes), reader_(options.recordings, options.rate) {}

  void run() {
    int64_t waiting = 0;
    while (reader_.next()) {
      if (read_++ == 0) configure();
      check(engine_.push(rows_of(reader_.view(), first_, count_)));
      if (++waiting == options_.window) end_window(&waiting);
    }
    if (read_ == 0) throw std::runtime_error("the recording has no frame");
    if (waiting > 0) end_window(&waiting);
    compare(read_);
  }

 private:
  static void check(const Status& status) {
    if (!status.ok()) throw std::runtime_error(status.message);
  }

  // What all processes must have found alike.
  void compare(int64_t value) const {
    int64_t sums[] = {value, value * value};
    processes_.add(sums);
    if (sums[0] != value * processes_.size() || sums[1] != value * value * processes_.size())
      throw std::runtime_error(
          "processes read different frames: do all machines have the same files?");
  }

  void configure() {
    info_ = reader_.info();
    compare(GST_VIDEO_INFO_WIDTH(&info_));
    compare(GST_VIDEO_INFO_HEIGHT(&info_));
    EngineOptions engine = engine_options(options_);
    set_format(info_, &engine);
    const int height = GST_VIDEO_INFO_HEIGHT(&info_), size = processes_.size();
    const auto top = [&](int rank) {
      const int rows = static_cast<int>(int64_t{height} * rank / size);
      return rank == size ? height : rows / engine.chroma_rows * engine.chroma_rows;
    };
    first_ = top(processes_.rank());
    count_ = top(processes_.rank() + 1) - first_;
    if (count_ < 1)
      throw std::runtime_error(std::to_string(height) + " rows are too few for " +
                               std::to_string(size) + " processes: start fewer");
    engine.first_row = first_;
    engine.add = [this](std::span<int64_t> values) { processes_.add(values); };
    const Status status = engine_.configure(engine, GST_VIDEO_INFO_WIDTH(&info_), count_);
    if (!status.ok()) throw std::invalid_argument(status.message);
    gst_video_info_set_format(&part_, GST_VIDEO_INFO_FORMAT(&info_),
                              static_cast<guint>(GST_VIDEO_INFO_WIDTH(&info_)),
                              static_cast<guint>(count_));
    part_.colorimetry = info_.colorimetry;
  }

  void end_window(int64_t* waiting) {
    // All of them, so that nobody waits for a sum of a process whose file is another one.
    compare(read_);
    check(engine_.drain());
    for (; *waiting > 0; --*waiting) engine_.next()->skip();
    write(window_++);
    // A window that ends early has the frames before it.
    engine_.go_on();
  }

  void write(int64_t window) {
    GstBuffer* const part = gst_buffer_new_allocate(nullptr, part_.size, nullptr);
    GstBuffer* whole = gst_buffer_new_allocate(nullptr, info_.size, nullptr);
    {
      const MappedVideoFrame mapped(&part_, part, GST_MAP_WRITE);
      engine_.write_background(mapped.view<uint8_t>());
      MappedVideoFrame all(&info_, whole, GST_MAP_WRITE);
      for (guint plane = 0; plane < GST_VIDEO_INFO_N_PLANES(&info_); ++plane) {
        gint component[GST_VIDEO_MAX_COMPONENTS];
        gst_video_format_info_component(info_.finfo, plane, component);
        const auto* const from =
            static_cast<const uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&mapped.frame(), plane));
        const auto stride = GST_VIDEO_FRAME_PLANE_STRIDE(&mapped.frame(), plane);
        const int rows = GST_VIDEO_FRAME_COMP_HEIGHT(&mapped.frame(), component[0]);
        std::vector<uint8_t> gathered;
        processes_.gather({from, from + static_cast<ptrdiff_t>(stride) * rows}, &gathered);
        if (processes_.rank() == 0)
          std::copy(gathered.begin(), gathered.end(),
                    static_cast<uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&all.frame(), plane)));
      }
    }
    if (processes_.rank() == 0) {
      const std::string path = picture_of(options_.wanted.front().path, window);
      write_png(temporary_of(path), info_, whole);
      give_name(path);
      if (!options_.quiet) std::fprintf(stderr, "%s\n", path.c_str());
    }
    gst_buffer_unref(part);
    gst_buffer_unref(whole);
  }

  const JobOptions& options_;
  const Processes& processes_;
  FrameReader reader_;
  Engine engine_;
  GstVideoInfo info_ = {}, part_ = {};
  int first_ = 0, count_ = 0;
  int64_t read_ = 0, window_ = 0;
};

}  // namespace

int run_rows(const JobOptions& options, int* argc, char*** argv) {
  check_wanted(options.wanted, options.recordings, options.report);
  if (options.wanted.size() > 1 || !options.wanted.front().is_picture() || options.jobs > 1 ||
      options.parts > 0 || options.resume || !options.report.empty())
    throw std::invalid_argument(
        "--by rows is for --background x.png alone, and for processes that mpirun starts, without "
        "--jobs, --part, --resume and --report");
  const Processes processes(argc, argv);
  try {
    Windows(options, processes).run();
  } catch (const std::exception& error) {
    if (processes.size() == 1) throw;
    std::fprintf(stderr, "qdmd-archive (process %d): %s\n", processes.rank(), error.what());
    std::fflush(stderr);
    processes.abort();
  }
  return 0;
}

}  // namespace qdmd::archive
