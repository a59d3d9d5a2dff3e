// SPDX-License-Identifier: LGPL-2.1-or-later
// What it takes to get a frame of each format in and a picture of it out. One thread, and the time
// that it computed, because others may use the machine.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/foreground/picture.h"
#include "core/frames/frame_store.h"
#include "core/passes/read_samples.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd;
using namespace qdmd::bench;

// Where the samples of a channel are: plane, the first sample, distances, and pixels that share
// one.
struct ChannelAt {
  int plane, offset, pixel_stride, columns = 1, rows = 1;
};
struct Format {
  const char* name;
  std::array<ChannelAt, 4> at;  // pixel_stride 0: no such channel
  SampleBits bits = {};
};
constexpr Format kFormats[] = {
    {"RGBA", {{{0, 0, 4}, {0, 1, 4}, {0, 2, 4}, {0, 3, 4}}}},
    {"RGB", {{{0, 0, 3}, {0, 1, 3}, {0, 2, 3}, {}}}},
    {"GBR", {{{2, 0, 1}, {0, 0, 1}, {1, 0, 1}, {}}}},
    {"I420", {{{0, 0, 1}, {1, 0, 1, 2, 2}, {2, 0, 1, 2, 2}, {}}}},
    {"A420", {{{0, 0, 1}, {1, 0, 1, 2, 2}, {2, 0, 1, 2, 2}, {3, 0, 1}}}},
    {"NV12", {{{0, 0, 1}, {1, 0, 2, 2, 2}, {1, 1, 2, 2, 2}, {}}}},
    {"Y42B", {{{0, 0, 1}, {1, 0, 1, 2, 1}, {2, 0, 1, 2, 1}, {}}}},
    {"NV16", {{{0, 0, 1}, {1, 0, 2, 2, 1}, {1, 1, 2, 2, 1}, {}}}},
    {"YUY2", {{{0, 0, 2}, {0, 1, 4, 2, 1}, {0, 3, 4, 2, 1}, {}}}},
    {"Y444", {{{0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {}}}},
    {"AYUV", {{{0, 1, 4}, {0, 2, 4}, {0, 3, 4}, {0, 0, 4}}}},
    {"GRAY8", {{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {}}}},
    {"I420_10LE", {{{0, 0, 2}, {1, 0, 2, 2, 2}, {2, 0, 2, 2, 2}, {}}}, {10, 0}},
    {"I422_10LE", {{{0, 0, 2}, {1, 0, 2, 2, 1}, {2, 0, 2, 2, 1}, {}}}, {10, 0}},
    {"Y444_10LE", {{{0, 0, 2}, {1, 0, 2}, {2, 0, 2}, {}}}, {10, 0}},
    {"P010_10LE", {{{0, 0, 2}, {1, 0, 4, 2, 2}, {1, 2, 4, 2, 2}, {}}}, {10, 6}},
    {"GRAY16_LE", {{{0, 0, 2}, {0, 0, 2}, {0, 0, 2}, {}}}, {16, 0}},
    {"RGBA64_LE", {{{0, 0, 8}, {0, 2, 8}, {0, 4, 8}, {0, 6, 8}}}, {16, 0}}};

bool is_rgb(const Format& format) {
  const std::string name = format.name;
  return name.find("GRAY") != 0 && name.find('R') != std::string::npos;
}

// What the default keeps of frames.
FrameContents contents_of(const Format& format) {
  FrameContents contents = {1, 0, 1, 1, format.bits.depth};
  const ChannelAt& chroma = format.at[1];
  if (chroma.columns > 1)
    contents.chroma_columns = chroma.columns, contents.chroma_rows = chroma.rows;
  return contents;
}

// A frame of a format, planes for it, and a background.
struct Scene {
  int width, height;
  std::vector<uint8_t> planes[4], x[3], mask, chroma;
  PlaneRows own;
  FrameStore store;
  MutableImageView view;
  BackgroundModel model;
  Levels levels;

  Scene(const Format& format, int width_, int height_)
      : width(width_), height(height_), store(1, width_, height_, contents_of(format)) {
    chroma.resize(room_for_planes(store.window().shape(), format.bits.depth));
    const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    std::array<ptrdiff_t, 4> stride{};
    for (const ChannelAt& at : format.at)
      stride[static_cast<size_t>(at.plane)] =
          std::max<ptrdiff_t>(stride[static_cast<size_t>(at.plane)],
                              (width + at.columns - 1) / at.columns * at.pixel_stride);
    view.width = width, view.height = height;
    view.bits = format.bits;
    bool even = true;
    for (size_t c = 0; c < 4; ++c) {
      const ChannelAt& at = format.at[c];
      if (at.pixel_stride == 0) continue;
      const auto plane = static_cast<size_t>(at.plane);
      planes[plane].resize(static_cast<size_t>(stride[plane] * height) + 8, 90);
      (c < 3 ? view.channel[c] : view.alpha) = planes[plane].data() + at.offset;
      view.own[c] = {at.pixel_stride, stride[plane], at.columns, at.rows};
      even = even && view.own[c] == view.own[0];
    }
    if (even) {
      view.pixel_stride = view.own[0].pixel_stride, view.row_stride = view.own[0].row_stride;
      for (Spacing& spacing : view.own) spacing = {};
    }
    if (!is_rgb(format)) levels = {{16, 128, 128}, {235, 128, 128}};
    for (auto& plane : x) plane.resize(pixels, 100);
    for (size_t p = 0; p < pixels; ++p) mask.push_back(p % 300 < 30 ? 255 : 0);
    split();
    model.set_depth(format.bits.depth);
    model.make_room(pixels, false);
    model.freeze_as({8, {x[0], x[1], x[2]}, {}}, nullptr, pixels);
    model.set_time(0);
  }

  // Takes the frame in, and spreads samples that pixels share, as masks need them.
  void split() {
    ImageView in;
    in.width = width, in.height = height;
    in.bits = view.bits;
    in.pixel_stride = view.pixel_stride, in.row_stride = view.row_stride;
    for (int c = 0; c < 3; ++c) in.channel[c] = view.channel[c];
    in.alpha = view.alpha;
    for (int c = 0; c < 4; ++c) in.own[c] = view.own[c];
    benchmark::DoNotOptimize(store.append(in));
    own = PlaneRows(store.window().picture(store.slot(0)), chroma.data());
    own.read_all(nullptr);
    benchmark::ClobberMemory();
  }
  void write(Output output) {
    OutputTask task = {};
    for (int c = 0; c < 3; ++c) task.x[c] = own.samples(c);
    task.model = &model, task.output = output, task.mask = mask.data(), task.constant_alpha = 255;
    write_picture(task, levels, view, 0, height);
  }
};

template <typename Work>
void add(const Format& format, const char* what, int width, int height, Work work) {
  const std::string name = std::string(what) + "/" + format.name + "/" + std::to_string(width) +
                           "x" + std::to_string(height);
  benchmark::RegisterBenchmark(
      name.c_str(),
      [=](benchmark::State& state) {
        Scene scene(format, width, height);
        double seconds = 0;
        int64_t turns = 0;
        for (auto _ : state) {
          const double took = seconds_of([&] { work(scene); }, CLOCK_THREAD_CPUTIME_ID);
          state.SetIterationTime(took);
          seconds += took, ++turns;
        }
        state.counters["ns_a_pixel"] =
            1e9 * seconds / static_cast<double>(turns) / (static_cast<double>(width) * height);
      })
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

}  // namespace

int main(int argc, char** argv) {
  for (const auto& [width, height] : {std::pair{160, 120}, {768, 576}, {1920, 1080}})
    for (const Format& format : kFormats) {
      add(format, "in", width, height, [](Scene& scene) { scene.split(); });
      for (const auto& [what, output] : {std::pair{"background", Output::background},
                                         {"foreground", Output::foreground},
                                         {"mask", Output::mask},
                                         {"cutout", Output::cutout}})
        add(format, what, width, height, [output = output](Scene& scene) { scene.write(output); });
    }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
