// SPDX-License-Identifier: LGPL-2.1-or-later
// Fuzz target: the engine and libqdmd, with any options, in any order of calls, where memory runs
// out, on windows of few pixels that are degenerate more often than not.
#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <stdexcept>
#include <vector>

#include "core/engine/engine.h"
#include "core/library/separator.h"
#include "core/model/learnt_file.h"
#include "tests/core/allocator.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace qdmd;
namespace allocator = qdmd::test::allocator;

// Frames of few pixels, with the samples where the layout says and nothing around them.
class Frame {
 public:
  static constexpr int kShared = 3;  // layouts: planes, pixels of four bytes, grey, 4:2:0
  Frame(int width, int height, int layout) : width_(width), height_(height), layout_(layout) {
    const allocator::Unseen unseen;
    const auto pixels = static_cast<size_t>(width * height);
    memory_.resize(layout == 0   ? 3 * pixels
                   : layout == 1 ? 4 * pixels
                   : layout == 2 ? pixels
                                 : pixels + 2 * chroma());
  }
  template <typename Byte>
  BasicImageView<Byte> view() {
    BasicImageView<Byte> view;
    view.width = width_;
    view.height = height_;
    if (layout_ == kShared) {
      // 4:2:0.
      for (int c = 0; c < 3; ++c) {
        const size_t before = c == 0 ? 0 : static_cast<size_t>(width_ * height_);
        view.channel[c] = memory_.data() + before + (c == 2 ? chroma() : 0);
        view.own[c] = c == 0 ? Spacing{1, width_, 1, 1} : Spacing{1, (width_ + 1) / 2, 2, 2};
      }
      return view;
    }
    const int step = layout_ == 1 ? 4 : 1;
    view.pixel_stride = step;
    view.row_stride = width_ * step;
    for (int c = 0; c < 3; ++c) {
      const int at = layout_ == 0 ? c * width_ * height_ : layout_ == 1 ? c : 0;
      view.channel[c] = memory_.data() + at;
    }
    if (layout_ == 1) view.alpha = memory_.data() + 3;
    return view;
  }
  std::vector<uint8_t>& bytes() { return memory_; }

 private:
  size_t chroma() const { return static_cast<size_t>((width_ + 1) / 2 * ((height_ + 1) / 2)); }

  int width_, height_, layout_;
  std::vector<uint8_t> memory_;
};

// What a scene of few pixels may show next.
void paint(fuzz::Bytes* bytes, int t, std::vector<uint8_t>* samples) {
  const uint8_t level = bytes->byte();
  switch (bytes->below(6)) {
    case 0:  // nothing moves
      break;
    case 1:
      samples->assign(samples->size(), level);
      break;
    case 2:
      for (uint8_t& sample : *samples) sample = bytes->byte();
      break;
    case 3:  // one sample differs
      if (!samples->empty()) (*samples)[level % samples->size()] ^= 255;
      break;
    case 4:  // all grow or fade alike: rank one
      for (uint8_t& sample : *samples) sample = static_cast<uint8_t>(sample * level / 128);
      break;
    default:  // two pictures in turn
      for (size_t i = 0; i < samples->size(); ++i)
        (*samples)[i] = static_cast<uint8_t>((i * level) % 251 + (t % 2 ? 4 : 0));
  }
}

// One input in 32, by a hash that its offspring does not inherit: else those with the slowest
// estimator, of which many do something new, soon take most of the time.
bool takes_long = false;

bool is_rare(const uint8_t* data, size_t size) {
  uint32_t hash = 2166136261;
  for (size_t i = 0; i < size; ++i) hash = (hash ^ data[i]) * 16777619;
  return (hash >> 16) % 32 == 0;
}

EngineOptions any_options(fuzz::Bytes* bytes) {
  EngineOptions options;
  const bool sane = !bytes->once_in(8);
  options.mode = static_cast<Mode>(bytes->below(2));
  options.method = static_cast<Method>(bytes->below(3));
  options.window_size = sane ? bytes->from(2, 9) : bytes->any_int();
  options.hop_size = sane ? bytes->below(options.window_size + 1) : bytes->any_int();
  options.iterations = sane ? bytes->from(1, 3) : bytes->any_int();
  options.sample_step = sane ? bytes->below(4) : bytes->any_int();
  options.dmd.rank = sane ? bytes->below(5) : bytes->any_int();
  options.dmd.solver = static_cast<Solver>(bytes->below(5));
  options.dmd.amplitude = static_cast<Amplitude>(bytes->below(2));
  // The others take longer, the last of them many times.
  if (const int rare = bytes->once_in(4) ? bytes->below(16) : 0; rare > 0)
    options.dmd.estimator = static_cast<Estimator>(rare == 3 ? 3 : rare % 3);
  if (options.dmd.estimator == Estimator::optimized) {
    if (!takes_long) options.dmd.estimator = Estimator::exact;
    options.window_size = std::min(options.window_size, 4);
    options.hop_size = 0;
  }
  options.dmd.spectrum = bytes->once_in(2);
  options.dmd.omega_threshold = sane ? bytes->byte() / 64.0 : bytes->any_double();
  options.foreground_threshold = sane ? bytes->byte() / 4.0 : bytes->any_double();
  options.stabilize = static_cast<Stabilize>(bytes->below(3));
  options.mask_softness = sane ? bytes->below(5) : bytes->any_int();
  options.threads = sane ? bytes->from(1, 2) : std::min(bytes->any_int(), 3);
  options.frame_rate = sane ? bytes->below(4) * 1000 : bytes->any_double();
  if (!sane && bytes->once_in(2)) options.max_memory = bytes->word();
  options.colours = static_cast<Colours>(bytes->below(3));
  if (bytes->once_in(3)) {
    options.chroma_columns = options.chroma_rows = 2;
    // Others are refused.
    if (sane) options.colours = Colours::yuv;
  }
  if (!sane) options.chroma_rows = bytes->any_int();
  if (bytes->once_in(4)) {
    for (int c = 0; c < 3; ++c) {
      options.levels.black[c] = bytes->byte();
      options.levels.white[c] = bytes->byte();
    }
  }
  return options;
}

bool is_number(double value) { return !std::isnan(value); }

// Nothing that is not a number leaves a solve.
void check_report(const SolveReport& report) {
  const DmdSummary& dmd = report.dmd;
  for (double value : {dmd.lambda.real(), dmd.lambda.imag(), dmd.omega, dmd.residual, dmd.condition,
                       dmd.rounding_bound, dmd.sensitivity, report.foreground.noise})
    QDMD_DEMAND(is_number(value));
  if (!dmd.spectrum) return;
  for (const SpectrumMode& mode : *dmd.spectrum)
    QDMD_DEMAND(is_number(mode.lambda.real()) && is_number(mode.lambda.imag()) &&
                is_number(mode.amplitude));
}

class EngineTrial {
 public:
  explicit EngineTrial(fuzz::Bytes* bytes) : bytes_(*bytes) {}

  void run() {
    configure();
    for (int calls = 0; calls < 24 && !bytes_.empty(); ++calls) {
      const bool failing = bytes_.once_in(16);
      if (failing) {
        failed_ = true;
        allocator::start();
        allocator::fail(bytes_.from(1, 40),
                        bytes_.once_in(2) ? allocator::Failing::all : allocator::Failing::one);
      }
      try {
        step();
      } catch (const std::bad_alloc&) {
        // What a solve beside the frames met comes out with a later call.
        QDMD_DEMAND(failed_);
        // What waited is gone, and the engine goes on; or it is not configured.
        // Where there was no memory for the sentence of a refusal, all is as it was.
        if (!kept_ && engine_.report().pending != waiting_) waiting_ = 0;
        kept_ = false;
      }
      if (failing) {
        allocator::fail_no_more();
        allocator::stop();
      }
      QDMD_DEMAND(engine_.report().pending == waiting_);
    }
    finish();
  }

 private:
  void configure() {
    const EngineOptions options = any_options(&bytes_);
    const bool any = bytes_.once_in(16);
    const int width = any ? bytes_.any_int() : bytes_.from(1, 12);
    const int height = any ? bytes_.any_int() : bytes_.from(1, 12);
    // Such sizes are for EnginePlan alone: memory would be there for some of them.
    if (any && int64_t{width} * height > 4096) {
      const Status status = EnginePlan(options, width, height).status();
      QDMD_DEMAND(status.ok() || !status.message.empty());
      return;
    }
    if (options.window_size > 64 && int64_t{width} * height > 64) return;
    const Status status = engine_.configure(options, width, height);
    QDMD_DEMAND(status.ok() || !status.message.empty());
    if (!status.ok()) return;
    width_ = width, height_ = height;
    waiting_ = 0;
    const allocator::Unseen unseen;
    // Others than were said are refused.
    const bool shared = options.chroma_columns == 2;
    const int other = bytes_.below(4);
    frame_ = std::make_unique<Frame>(width, height,
                                     shared && !bytes_.once_in(8) ? Frame::kShared : other);
    QDMD_DEMAND(engine_.report().delay >= 0);
  }
  void push() {
    if (!frame_) return;
    paint(&bytes_, time_++, &frame_->bytes());
    const bool ready = engine_.next() != nullptr;
    const Status status = engine_.push(frame_->view<const uint8_t>(), &wishes_);
    QDMD_DEMAND(!ready || !status.ok());
    waiting_ += status.ok();
    // Alpha for which there is no room.
    if (status.code == Status::Code::too_much_memory) waiting_ = 0;
    // Mostly one leaves for each that comes.
    if (bytes_.once_in(16)) return;
    while (engine_.next()) pop();
  }
  void pop() {
    LeavingFrame* const frame = engine_.next(&wishes_);
    if (!frame) return;
    Frame out(width_, height_, bytes_.below(2));
    for (int pictures = bytes_.below(3); pictures > 0; --pictures)
      frame->write(static_cast<Output>(bytes_.below(4)), Levels(), out.view<uint8_t>());
    if (bytes_.once_in(8)) {
      const auto pixels = static_cast<size_t>(width_ * height_);
      // In one, whose halves they are.
      std::vector<uint8_t> both;
      {
        const allocator::Unseen unseen;
        both.resize(2 * pixels);
      }
      frame->foreground(both.data(), both.data() + pixels);
    }
    frame->skip();
    --waiting_;
  }
  void step() {
    switch (bytes_.below(24)) {
      case 0:
        configure();
        break;
      case 1:
        if (engine_.configured()) QDMD_DEMAND(engine_.drain().ok());
        break;
      case 2:
        engine_.flush();
        waiting_ = 0;
        break;
      case 3:
        pop();
        break;
      case 4:
        wishes_.foreground_threshold = bytes_.byte();
        break;
      case 5:
        wishes_.mask_softness = bytes_.below(16);
        break;
      case 6: {
        IgnoredAreas areas;
        for (int count = bytes_.below(4); count > 0; --count) {
          Rectangle area;
          area.x = bytes_.any_int();
          area.y = bytes_.any_int();
          area.width = bytes_.any_int();
          area.height = bytes_.any_int();
          areas.add(area);
        }
        wishes_.ignored = areas;
        break;
      }
      case 7:
        wishes_.masks_expected = bytes_.once_in(2);
        break;
      case 8:
        wishes_.absorb_frames = bytes_.below(20);
        break;
      case 9:
        wishes_.shadows = static_cast<Shadows>(bytes_.below(3));
        break;
      case 10:
        wishes_.stabilize_output = bytes_.once_in(2);
        break;
      case 11:
        wishes_.freeze = bytes_.once_in(2);
        break;
      case 12:
        wishes_.time_budget = bytes_.byte() / 1e5;
        break;
      case 13:
        wishes_.threads = bytes_.from(1, 3);
        break;
      case 14:
        keep_learnt();
        break;
      case 15:
        if (learnt_.width > 0) {
          kept_ = true;
          (void)engine_.learn_from(learnt_);
          kept_ = false;
        }
        break;
      case 16:
        if (frame_) {
          Frame out(width_, height_, bytes_.below(2));
          (void)engine_.write_background(out.view<uint8_t>());
        }
        break;
      case 17:
        if (bytes_.once_in(4)) {
          engine_.close();
          waiting_ = 0;
          frame_.reset();
        }
        break;
      default:
        push();
    }
    check_report(engine_.report().solve);
    if (LeavingFrame* const frame = engine_.next()) (void)frame->pose();
  }
  void keep_learnt() {
    // No frame is lost where memory runs out.
    kept_ = true;
    Learnt learnt;
    const bool known = engine_.learnt(&learnt);
    kept_ = false;
    if (!known) return;
    const allocator::Unseen unseen;
    Learnt read;
    QDMD_DEMAND(unpack(pack(learnt), &read).ok());
    learnt_ = std::move(read);
  }
  // All that waits leaves, or is gone where there was no memory for its solve.
  void finish() {
    if (!engine_.configured()) return;
    try {
      while (engine_.next()) pop();
      QDMD_DEMAND(engine_.drain().ok());
      while (engine_.next()) pop();
    } catch (const std::bad_alloc&) {
      QDMD_DEMAND(failed_);
      waiting_ = 0;
    }
    QDMD_DEMAND(waiting_ == 0 && engine_.report().pending == 0);
  }

  fuzz::Bytes& bytes_;
  Engine engine_;
  Wishes wishes_;
  Learnt learnt_;
  std::unique_ptr<Frame> frame_;
  int width_ = 0, height_ = 0, waiting_ = 0, time_ = 0;
  bool failed_ = false;  // an allocation, by now
  bool kept_ = false;    // no frame may be lost by what is called now
};

// Takes all that the library says of the frames that are ready.
void take_from(library::Separator* separator, const library::Layout& layout, fuzz::Bytes* bytes) {
  for (; separator->ready(); separator->skip()) {
    std::vector<uint8_t> picture(static_cast<size_t>(layout.height) *
                                 static_cast<size_t>(layout.row_bytes));
    separator->write(static_cast<library::Output>(bytes->below(4)), layout, picture.data());
    if (bytes->once_in(3))
      for (const library::Region& region : separator->regions(bytes->below(4)))
        QDMD_DEMAND(region.x >= 0 && region.x + region.width <= layout.width && region.y >= 0 &&
                    region.y + region.height <= layout.height && region.area > 0);
  }
}

void try_library(fuzz::Bytes* bytes) {
  library::Options options;
  const bool sane = !bytes->once_in(8);
  options.method = static_cast<library::Method>(bytes->below(3));
  options.mode = static_cast<library::Mode>(bytes->below(2));
  options.window_size = sane ? bytes->from(2, 6) : bytes->any_int();
  options.hop_size = sane ? bytes->below(3) : bytes->any_int();
  options.stabilize = static_cast<library::Stabilize>(bytes->below(3));
  options.shadows = static_cast<library::Shadows>(bytes->below(3));
  options.mask_softness = bytes->once_in(4) ? bytes->below(20) : 0;
  options.foreground_threshold = sane ? bytes->byte() : bytes->any_double();
  options.absorb_frames = sane ? bytes->byte() : bytes->any_int();
  options.threads = sane ? 1 : std::min(bytes->any_int(), 3);
  const bool hard = options.mask_softness == 0 && options.shadows != library::Shadows::marked;
  try {
    library::Separator separator(options);
    // Few are enough, and an eighth of the inputs may not take most of the time.
    int left = 16;
    for (int t = 0; left > 0 && !bytes->empty(); ++t) {
      library::Layout layout{bytes->from(1, 8), bytes->from(1, 8), 0,
                             static_cast<library::Pixels>(bytes->below(5)),
                             bytes->once_in(4) ? bytes->from(9, 16) : 8};
      if (bytes->once_in(12)) layout.width = -bytes->below(3);
      const int padding = bytes->below(5);
      constexpr int kSamples[] = {1, 3, 3, 4, 4};
      layout.row_bytes = kSamples[static_cast<int>(layout.pixels)] * std::max(layout.width, 0) *
                             (layout.depth > 8 ? 2 : 1) +
                         padding;
      if (bytes->once_in(20)) layout.row_bytes -= bytes->below(9);
      const auto rows = static_cast<size_t>(layout.height);
      const auto row_bytes = static_cast<size_t>(std::max<ptrdiff_t>(layout.row_bytes, 0));
      const auto width = static_cast<size_t>(std::max(layout.width, 0)), mask_row = width + 3;
      // Frames of one size come one after the other.
      for (int frames = bytes->from(1, 6); frames > 0 && left > 0; --frames, --left) {
        std::vector<uint8_t> picture(rows * row_bytes), mask(rows * mask_row);
        paint(bytes, t, &picture);
        if (bytes->once_in(12)) separator.freeze(bytes->once_in(2));
        if (bytes->once_in(12)) separator.ignore({{bytes->below(9) - 3, 0, 3, 4}});
        if (bytes->once_in(24)) separator.reset();
        if (options.mode == library::Mode::batch || bytes->once_in(3)) {
          separator.push(picture.data(), layout);
          take_from(&separator, layout, bytes);
          if (bytes->once_in(6)) separator.drain();
          take_from(&separator, layout, bytes);
        } else {
          separator.apply(picture.data(), layout, mask.data(), static_cast<ptrdiff_t>(mask_row));
          for (size_t y = 0; y < rows; ++y)
            for (size_t x = 0; x < mask_row; ++x) {
              const uint8_t value = mask[y * mask_row + x];
              QDMD_DEMAND(x < width ? !hard || value == 0 || value == 255 : value == 0);
            }
          if (bytes->once_in(4)) QDMD_DEMAND(separator.background(layout, picture.data()));
        }
        if (bytes->once_in(8)) {
          const std::vector<uint8_t> saved = separator.save();
          if (!saved.empty()) separator.load(saved.data(), saved.size());
          take_from(&separator, layout, bytes);
        }
      }
    }
  } catch (const std::invalid_argument& refused) {
    QDMD_DEMAND(refused.what()[0] != 0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Bytes bytes(data, size);
  takes_long = is_rare(data, size);
  if (bytes.once_in(8))
    try_library(&bytes);
  else
    EngineTrial(&bytes).run();
  return 0;
}
