#include "core/library/separator.h"

#include <stdexcept>

#include "core/engine/engine.h"

namespace qdmd::library {
namespace {

EngineOptions engine_options(const Options& options) {
  EngineOptions result;
  switch (options.method) {
    case Method::robust:
      result.method = qdmd::Method::robust;
      break;
    case Method::qdmd:
      result.method = qdmd::Method::qdmd;
      break;
    case Method::dmd:
      result.method = qdmd::Method::dmd;
      break;
  }
  result.mode = Mode::live;
  result.window_size = options.window_size;
  result.hop_size = options.hop_size;
  result.stabilize = options.stabilize ? Stabilize::translation : Stabilize::off;
  result.foreground_threshold = options.foreground_threshold;
  result.threads = options.threads;
  result.max_memory = options.max_memory;
  return result;
}

template <typename Byte>
BasicImageView<Byte> view_of(Byte* samples, const Layout& layout) {
  BasicImageView<Byte> view;
  for (int c = 0; c < kChannels; ++c)
    view.channel[c] = samples + (layout.blue_first ? kChannels - 1 - c : c);
  view.width = layout.width;
  view.height = layout.height;
  view.pixel_stride = kChannels;
  view.row_stride = layout.row_bytes;
  return view;
}

void check(const Status& status) {
  if (!status.ok()) throw std::invalid_argument(status.message);
}

}  // namespace

struct Separator::State {
  explicit State(const Options& o) : options(o) {
    wishes = first_wishes(engine_options(options));
    wishes.absorb_frames = options.absorb_frames;
  }

  void configure(int w, int h) {
    if (engine.configured() && w == width && h == height) return;
    engine.close();
    width = height = 0;
    check(engine.configure(engine_options(options), w, h));
    width = w, height = h;
  }

  Options options;
  Wishes wishes;
  Engine engine;
  int width = 0, height = 0;
};

Separator::Separator(const Options& options) : state_(std::make_unique<State>(options)) {
  if (options.absorb_frames < 0)
    throw std::invalid_argument("absorb_frames must be 0 (never) or more");
  check(EnginePlan(engine_options(options), 1, 1).status());
}
Separator::~Separator() = default;
Separator::Separator(Separator&&) noexcept = default;
Separator& Separator::operator=(Separator&&) noexcept = default;

void Separator::apply(const uint8_t* frame, const Layout& layout, uint8_t* mask,
                      ptrdiff_t mask_row_bytes) {
  state_->configure(layout.width, layout.height);
  Engine& engine = state_->engine;
  check(engine.push(view_of(frame, layout), &state_->wishes));
  // One plane stands for all three channels.
  MutableImageView out;
  for (uint8_t*& channel : out.channel) channel = mask;
  out.width = layout.width;
  out.height = layout.height;
  out.pixel_stride = 1;
  out.row_stride = mask_row_bytes;
  engine.next()->pop(Output::mask, out);
}

bool Separator::background(const Layout& layout, uint8_t* picture) {
  if (layout.width != state_->width || layout.height != state_->height) return false;
  return state_->engine.write_background(view_of(picture, layout));
}

void Separator::freeze(bool freeze) { state_->wishes.freeze = freeze; }

}  // namespace qdmd::library
