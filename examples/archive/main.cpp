// SPDX-License-Identifier: LGPL-2.1-or-later
// qdmd-archive: backgrounds, masks and foregrounds of recordings, by as many processes as there
// are.
#include <gst/gst.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <new>

#include "examples/archive/element_options.h"
#include "examples/archive/job.h"
#include "examples/archive/launch.h"
#include "examples/archive/rows.h"
#include "examples/archive/video_writer.h"

namespace {

using namespace qdmd;
using namespace qdmd::archive;

struct Words {
  std::string background, mask, foreground, cutout, part, by = "time";
};

void declare(CLI::App& app, JobOptions& options, Words& words) {
  app.add_option("recording", options.recordings,
                 "Files that are one recording, in this order; or a folder of pictures (PNG or "
                 "JPEG), in the order of their names")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--background", words.background,
                 "Backgrounds: .png, a picture of each window (-2, -3 .. after the first's name), "
                 "or .mkv, a video of each frame's");
  app.add_option("--mask", words.mask, "Video of the masks, .mkv");
  app.add_option("--foreground", words.foreground, "Video of the foreground, .mkv");
  app.add_option("--cutout", words.cutout, "Video of the frames where the mask is set, .mkv");
  app.add_option("--jobs", options.jobs, "Processes that share the recording on this machine")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option("--part", words.part,
                 "K/N: this process does the K-th of N shares, and others, started in the same "
                 "way, the rest; the last one that ends joins them");
  app.add_flag("--join", options.join, "Do nothing but join what all parts have done");
  app.add_option("--stretch", options.stretch,
                 "Frames that a process takes at a time (0: the recording's share, at most 15 "
                 "times --warm-up)")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 40))
      ->capture_default_str();
  app.add_option(
         "--warm-up", options.warm_up,
         "Frames before a stretch that the process looks at first (-1: five windows, or some more)")
      ->check(CLI::Range(int64_t{-1}, int64_t{1} << 40))
      ->capture_default_str();
  app.add_option("--by", words.by,
                 "What processes share out: time, or the rows of each window, for --background "
                 "x.png with --method qdmd or dmd: a window may then be larger than a machine")
      ->check(CLI::IsMember({"time", "rows"}))
      ->capture_default_str();
  app.add_option("--framerate", options.rate, "Of pictures, frames a second")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  app.add_option("--encoder", options.encoder,
                 "Elements of GStreamer that make a file of raw video; the default loses nothing")
      ->capture_default_str();
  app.add_flag("--resume", options.resume, "Go on with what an earlier job has not done");
  app.add_option("--report", options.report,
                 "Write what each stretch took in memory and time, as JSON, to this file (-: to "
                 "standard output)");
  app.add_flag("--quiet", options.quiet, "Say nothing but errors");
  for (const ElementOption& option : element_options())
    app.add_option_function<std::string>(
           "--" + option.name + (option.name == "window-size" ? ",--window" : ""),
           [&options, name = option.name](const std::string& value) {
             options.properties[name] = value;
           },
           option.help)
        ->group("As the element's property")
        ->default_str(option.preset);
}

void understand(const Words& words, JobOptions* options) {
  const auto add = [&](Output output, const std::string& path) {
    if (!path.empty()) options->wanted.push_back({output, path});
  };
  add(Output::background, words.background);
  add(Output::mask, words.mask);
  add(Output::foreground, words.foreground);
  add(Output::cutout, words.cutout);
  char rest = 0;
  if (!words.part.empty() &&
      (std::sscanf(words.part.c_str(), "%d/%d%c", &options->part, &options->parts, &rest) != 2 ||
       options->part < 1 || options->part > options->parts))
    throw std::invalid_argument("--part is K/N with 1 <= K <= N, as 3/16");
  // What is as large as the recording needs is not asked for by mistake.
  options->properties.try_emplace("max-memory", std::to_string(UINT64_MAX));
  const bool alone = options->jobs == 1 && ranks_of_environment().size == 1;
  if (!alone) options->properties.try_emplace("n-threads", "1");
  GstElement* const element = make_element(options->properties);
  guint window = 0;
  g_object_get(element, "window-size", &window, nullptr);
  gst_object_unref(element);
  options->window = static_cast<int>(window);
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
  try {
    gst_init(nullptr, nullptr);
    JobOptions options;
    options.encoder = kLossless;
    Words words;
    CLI::App app(
        "Separates background and foreground of recordings, stretch after stretch, by as many "
        "processes as --jobs, --part or mpirun start.");
    declare(app, options, words);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? 0 : 2;
    }
    understand(words, &options);
    if (words.by == "rows") return run_rows(options, &argc, &argv);
    return run_job(options, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "qdmd-archive: %s\n", error.what());
    return 2;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr,
                 "qdmd-archive: not enough memory for the window: lower --window-size, or scale "
                 "the video down\n");
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "qdmd-archive: %s\n", error.what());
    return 1;
  }
}
