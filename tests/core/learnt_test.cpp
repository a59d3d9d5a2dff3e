// What was learnt: as bytes, and given to another engine.
#include "core/model/learnt_file.h"

#include <bit>
#include <cstdlib>
#include <limits>

#include "core/passes/grid.h"
#include "tests/core/live_util.h"

namespace qdmd::test {
namespace {

// An engine for pictures of width x height, fed from planes.
struct Box {
  int width, height;
  Engine engine;

  Box(int width_, int height_, const EngineOptions& options) : width(width_), height(height_) {
    const Status status = engine.configure(options, width, height);
    EXPECT_TRUE(status.ok()) << status.message;
  }
  std::vector<std::vector<uint8_t>> push(const std::vector<uint8_t>& planes,
                                         Output output = Output::background) {
    Picture picture(width, height);
    picture.fill(planes);
    EXPECT_TRUE(engine.push(picture.in()).ok());
    return pop(output);
  }
  std::vector<std::vector<uint8_t>> pop(Output output = Output::background) {
    std::vector<std::vector<uint8_t>> all;
    while (engine.ready()) {
      Picture out(width, height);
      engine.pop(output, out.out());
      all.push_back(out.planes());
    }
    return all;
  }
  std::vector<uint8_t> background() {
    Picture out(width, height);
    EXPECT_TRUE(engine.write_background(out.out()));
    return out.planes();
  }
  Learnt learnt() {
    Learnt learnt;
    EXPECT_TRUE(engine.learnt(&learnt));
    return learnt;
  }
};

std::vector<uint8_t> planes_of(const Learnt& learnt) {
  std::vector<uint8_t> planes;
  for (const auto& level : learnt.level) planes.insert(planes.end(), level.begin(), level.end());
  return planes;
}

// A still picture with a bright block that walks, or stays at `at`.
constexpr int kWidth = 64, kHeight = 48;
std::vector<uint8_t> scene(int at, int light = 100) {
  std::vector<uint8_t> planes;
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const bool block = x >= at && x < at + 10 && y >= 16 && y < 34;
        const int level = block ? 230 - 60 * c : 60 + (7 * x + 3 * y + 31 * c) % 60;
        planes.push_back(static_cast<uint8_t>(level * light / 100));
      }
  return planes;
}
std::vector<uint8_t> walking(int t) { return scene((3 * t) % 80 - 12); }
std::vector<uint8_t> empty_scene() { return scene(-100); }

EngineOptions options_of(Mode mode, Method method, int window = 30) {
  EngineOptions options;
  options.mode = mode;
  options.method = method;
  options.window_size = window;
  options.threads = 2;
  return options;
}

// What an engine learns from the scene.
Learnt learnt_by(const EngineOptions& options, int frames = 60) {
  Box box(kWidth, kHeight, options);
  for (int t = 0; t < frames; ++t) box.push(walking(t));
  return box.learnt();
}

double mean_distance(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

Learnt small(bool limits, bool earlier) {
  Learnt learnt;
  learnt.width = 5;
  learnt.height = 3;
  learnt.colours = Colours::yuv;
  learnt.noise = 1.25;
  uint8_t next = 3;
  const auto plane = [&] {
    std::vector<uint8_t> levels(15);
    for (uint8_t& level : levels) level = next = static_cast<uint8_t>(7 * next + 1);
    return levels;
  };
  for (auto& level : learnt.level) level = plane();
  if (limits) learnt.limits = plane();
  if (earlier) {
    auto& e = learnt.earlier.emplace();
    for (auto& level : e.level) level = plane();
    e.spread = plane();
    e.rows = 2;
    e.cols = 3;
    e.weight = {0, 1.5f, 2, 3e6f, 4, 0.001f};
    e.limit = {6, 7, 8, 9, 10, 11};
  }
  return learnt;
}

void expect_equal(const Learnt& a, const Learnt& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.colours, b.colours);
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(a.level[c], b.level[c]);
  EXPECT_EQ(a.limits, b.limits);
  EXPECT_EQ(a.noise, b.noise);
  ASSERT_EQ(a.earlier.has_value(), b.earlier.has_value());
  if (!a.earlier) return;
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(a.earlier->level[c], b.earlier->level[c]);
  EXPECT_EQ(a.earlier->spread, b.earlier->spread);
  EXPECT_EQ(a.earlier->rows, b.earlier->rows);
  EXPECT_EQ(a.earlier->cols, b.earlier->cols);
  EXPECT_EQ(a.earlier->weight, b.earlier->weight);
  EXPECT_EQ(a.earlier->limit, b.earlier->limit);
}

Status unpack_it(const std::vector<uint8_t>& bytes) {
  const Learnt before = small(true, true);
  Learnt read = before;
  const Status status = unpack(bytes, &read);
  if (!status.ok()) expect_equal(before, read);
  return status;
}

// With a checksum that fits.
void sign(std::vector<uint8_t>* bytes) {
  uint64_t hash = 0xcbf29ce484222325;
  for (size_t i = 0; i + 8 < bytes->size(); ++i) hash = (hash ^ (*bytes)[i]) * 0x100000001b3;
  for (size_t i = 0; i < 8; ++i)
    (*bytes)[bytes->size() - 8 + i] = static_cast<uint8_t>(hash >> (8 * i));
}

// ---- Bytes ----

TEST(LearntFile, RoundTrip) {
  for (bool limits : {false, true})
    for (bool earlier : {false, true}) {
      const Learnt learnt = small(limits, earlier);
      const auto bytes = pack(learnt);
      const auto header = std::span(bytes).first(kLearntHeaderBytes);
      EXPECT_TRUE(check_header(header, bytes.size()).ok());
      EXPECT_FALSE(check_header(header, bytes.size() + 1).ok());
      Learnt read;
      const Status status = unpack(bytes, &read);
      ASSERT_TRUE(status.ok()) << status.message;
      expect_equal(learnt, read);
      EXPECT_EQ(bytes, pack(read));
    }
}

TEST(LearntFile, TheBytesAreTheseOnEveryMachine) {
  const auto bytes = pack(small(false, false));
  const std::vector<uint8_t> header = {
      0x89, 'Q', 'D', 'M', 'D', '\r', '\n', 0x1a, 1,    0,    0,   0, 5, 0, 0, 0, 3, 0, 0,
      0,    1,   0,   0,   0,   0,    0,    0,    0,    0,    0,   0, 0, 0, 0, 0, 0, 0, 0,
      0,    0,   0,   0,   0,   0,    0,    0,    0xf4, 0x3f, 109, 0, 0, 0, 0, 0, 0, 0};
  ASSERT_EQ(kLearntHeaderBytes, header.size());
  ASSERT_EQ(109u, bytes.size());
  EXPECT_EQ(header, std::vector<uint8_t>(bytes.begin(), bytes.begin() + 56));
}

TEST(LearntFile, EveryDamageIsSeen) {
  for (bool sections : {false, true}) {
    const auto whole = pack(small(sections, sections));
    for (size_t at = 0; at < whole.size(); ++at)
      for (int bit = 0; bit < 8; ++bit) {
        auto bytes = whole;
        bytes[at] = static_cast<uint8_t>(bytes[at] ^ (1 << bit));
        const Status status = unpack_it(bytes);
        ASSERT_FALSE(status.ok()) << at;
        ASSERT_EQ(Status::Code::bad_file, status.code);
        ASSERT_NE(std::string::npos, status.message.find(':')) << status.message;
      }
    for (size_t size = 0; size < whole.size(); ++size)
      ASSERT_FALSE(unpack_it({whole.begin(), whole.begin() + static_cast<ptrdiff_t>(size)}).ok())
          << size;
    auto longer = whole;
    longer.push_back(0);
    EXPECT_FALSE(unpack_it(longer).ok());
  }
}

// Of a picture of a usual size: a sample of its bytes, all of them with QDMD_LONG.
TEST(LearntFile, DamageInALargeFileIsSeen) {
  const auto whole = pack(learnt_by(options_of(Mode::batch, Method::robust)));
  const size_t step = std::getenv("QDMD_LONG") ? 1 : 97;
  auto bytes = whole;
  for (size_t at = 0; at < whole.size(); at += step) {
    bytes[at] ^= 0x10;
    ASSERT_FALSE(unpack_it(bytes).ok()) << at;
    bytes[at] = whole[at];
    if (step > 1 || at % 97 == 0) {
      ASSERT_FALSE(unpack_it({whole.begin(), whole.begin() + static_cast<ptrdiff_t>(at)}).ok())
          << at;
    }
  }
  EXPECT_TRUE(unpack_it(bytes).ok());
}

// Somebody may write a file whose checksum is right.
TEST(LearntFile, NumbersThatMakeNoSenseAreRefusedBeforeMemoryIsTaken) {
  const auto whole = pack(small(true, true));
  constexpr size_t kWeights = 56 + 15 * 8;
  const auto with = [&](size_t at, auto number) {
    auto bytes = whole;
    for (size_t i = 0; i < sizeof number; ++i)
      bytes[at + i] = static_cast<uint8_t>(number >> (8 * i));
    sign(&bytes);
    return unpack_it(bytes);
  };
  ASSERT_TRUE(with(12, uint32_t{5}).ok());
  for (uint32_t number : {0u, 1u, 4u, 6u, 15u, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
    EXPECT_FALSE(with(12, number).ok()) << number;
    EXPECT_FALSE(with(16, number).ok()) << number;
    EXPECT_FALSE(with(32, number).ok()) << number;
    EXPECT_FALSE(with(48, uint64_t{number} << 16).ok()) << number;
    if (number != 0) {
      EXPECT_FALSE(with(36, number).ok()) << number;
    }
  }
  EXPECT_TRUE(with(20, uint32_t{2}).ok());
  EXPECT_FALSE(with(20, uint32_t{3}).ok());
  for (uint32_t sections : {0u, 1u, 2u, 4u, 7u}) EXPECT_FALSE(with(24, sections).ok());
  for (double noise :
       {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_FALSE(with(40, std::bit_cast<uint64_t>(noise)).ok()) << noise;
  for (float number :
       {-1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
    for (size_t at : {kWeights, kWeights + 4 * 6 + 4})
      EXPECT_FALSE(with(at, std::bit_cast<uint32_t>(number)).ok()) << number;
  // A picture that no memory holds, in a file that says so rightly.
  auto bytes = whole;
  for (size_t at : {12u, 16u}) bytes[at] = bytes[at + 1] = 0xff, bytes[at + 2] = 3;
  sign(&bytes);
  EXPECT_FALSE(unpack_it(bytes).ok());
}

TEST(LearntFile, SaysWhatIsWrong) {
  const auto whole = pack(small(true, true));
  const auto message = [](const std::vector<uint8_t>& bytes) { return unpack_it(bytes).message; };
  EXPECT_NE(std::string::npos, message({}).find("empty"));
  EXPECT_NE(std::string::npos, message({'G', 'I', 'F', '8'}).find("no file that qdmdbackground"));
  auto newer = whole;
  newer[8] = 9;
  EXPECT_NE(std::string::npos, message(newer).find("version 9"));
  auto shorter = whole;
  shorter.pop_back();
  EXPECT_NE(std::string::npos, message(shorter).find("bytes in place of")) << message(shorter);
  auto other = whole;
  other[70] ^= 1;
  EXPECT_NE(std::string::npos, message(other).find("checksum"));
}

// ---- Engines ----

TEST(Learnt, NothingIsKnownBeforeTheFirstSolve) {
  Learnt learnt = small(true, false);
  Engine none;
  EXPECT_FALSE(none.learnt(&learnt));
  EXPECT_EQ(Status::Code::not_configured, none.learn_from(learnt).code);
  Box box(kWidth, kHeight, options_of(Mode::batch, Method::robust));
  for (int t = 0; t < 20; ++t) box.push(walking(t));
  EXPECT_FALSE(box.engine.learnt(&learnt));
  expect_equal(learnt, small(true, false));
}

TEST(Learnt, AnotherSizeIsRefusedAndChangesNothing) {
  Box box(kWidth, kHeight, options_of(Mode::live, Method::robust));
  for (int t = 0; t < 40; ++t) box.push(walking(t));
  const auto before = pack(box.learnt());
  const Status status = box.engine.learn_from(small(true, true));
  EXPECT_EQ(Status::Code::invalid_options, status.code);
  EXPECT_NE(std::string::npos, status.message.find("5x3")) << status.message;
  EXPECT_NE(std::string::npos, status.message.find("64x48")) << status.message;
  EXPECT_EQ(before, pack(box.learnt()));
}

TEST(Learnt, SavedAndLoadedIsTheSameFile) {
  for (Method method : {Method::robust, Method::qdmd, Method::dmd})
    for (Mode mode : {Mode::live, Mode::batch}) {
      const auto options = options_of(mode, method);
      Box first(kWidth, kHeight, options);
      for (int t = 0; t < 60; ++t) first.push(walking(t));
      const Learnt learnt = first.learnt();
      EXPECT_EQ(first.background(), planes_of(learnt));
      EXPECT_EQ(method == Method::robust, learnt.earlier.has_value());
      EXPECT_EQ(method == Method::robust, !learnt.limits.empty());
      Learnt read;
      ASSERT_TRUE(unpack(pack(learnt), &read).ok());
      Box second(kWidth, kHeight, options);
      ASSERT_TRUE(second.engine.learn_from(read).ok());
      EXPECT_EQ(pack(learnt), pack(second.learnt()));
      EXPECT_EQ(planes_of(learnt), second.background());
      EXPECT_EQ(0u, second.engine.solves());
      EXPECT_EQ(first.engine.report().foreground.threshold,
                second.engine.report().foreground.threshold);
    }
}

TEST(Learnt, LiveHasItsBackgroundWithTheFirstFrame) {
  for (Method method : {Method::robust, Method::qdmd}) {
    const auto options = options_of(Mode::live, method);
    const Learnt learnt = learnt_by(options);
    Box box(kWidth, kHeight, options);
    ASSERT_TRUE(box.engine.learn_from(learnt).ok());
    // A segment comes before the first frame.
    ASSERT_TRUE(box.engine.drain().ok());
    // Somebody stands there from the start.
    const auto pictures = box.push(scene(20));
    ASSERT_EQ(1u, pictures.size());
    EXPECT_EQ(planes_of(learnt), pictures[0]);
    EXPECT_EQ(0u, box.engine.solves());
    const auto mask = box.push(scene(20), Output::mask)[0];
    EXPECT_EQ(255, mask[static_cast<size_t>(25 * kWidth + 25)]);
    // Q-DMD's picture has traces of who walked.
    if (method == Method::robust) {
      EXPECT_EQ(0, mask[static_cast<size_t>(25 * kWidth + 45)]);
    }
    for (int t = 0; t < 40; ++t) box.push(walking(t));
    EXPECT_GT(box.engine.solves(), 0u);
    EXPECT_LT(mean_distance(box.background(), empty_scene()), 4);
  }
}

TEST(Learnt, LiveFollowsTheLight) {
  const auto options = options_of(Mode::live, Method::robust);
  const Learnt learnt = learnt_by(options);
  Box box(kWidth, kHeight, options);
  ASSERT_TRUE(box.engine.learn_from(learnt).ok());
  const auto dim = box.push(scene(20, 60));
  EXPECT_LT(mean_distance(dim[0], scene(-100, 60)), 2);
  EXPECT_EQ(planes_of(learnt), box.background()) << "what is saved has its own light";
}

TEST(Learnt, WhileLiveLosesNoFrame) {
  const auto options = options_of(Mode::live, Method::robust);
  const Learnt learnt = learnt_by(options);
  Box box(kWidth, kHeight, options);
  size_t frames = 0;
  for (int t = 0; t < 200; ++t) {
    Picture picture(kWidth, kHeight);
    picture.fill(scene(20));
    ASSERT_TRUE(box.engine.push(picture.in()).ok());
    // Between a frame and its picture, too.
    if (t == 90 || t == 95 || t == 163) {
      ASSERT_TRUE(box.engine.learn_from(learnt).ok());
      EXPECT_EQ(planes_of(learnt), box.background());
    }
    const auto out = box.pop();
    frames += out.size();
    if (t == 90 || t == 91) {
      EXPECT_EQ(planes_of(learnt), out[0]) << t;
    }
  }
  EXPECT_EQ(200u, frames);
}

TEST(Learnt, BatchIsToldOfIt) {
  const auto options = options_of(Mode::batch, Method::robust);
  const Learnt learnt = learnt_by(options);
  const auto standing = [](int t) { return scene(t < 18 ? 20 : 70); };
  const auto window = [&](Box& box) {
    std::vector<std::vector<uint8_t>> all;
    for (int t = 0; t < 30; ++t)
      for (auto& picture : box.push(standing(t))) all.push_back(std::move(picture));
    EXPECT_TRUE(box.engine.drain().ok());
    for (auto& picture : box.pop()) all.push_back(std::move(picture));
    return all;
  };
  Box told(kWidth, kHeight, options), alone(kWidth, kHeight, options);
  ASSERT_TRUE(told.engine.learn_from(learnt).ok());
  EXPECT_EQ(planes_of(learnt), told.background());
  const auto with = window(told), without = window(alone);
  ASSERT_EQ(30u, with.size());
  ASSERT_EQ(30u, without.size());
  EXPECT_EQ(1u, told.engine.solves());
  EXPECT_LT(mean_distance(with[5], empty_scene()), 2);
  // What is confirmed weighs more than what one window saw.
  const auto weight = [](Box& box) { return box.learnt().earlier.value().weight.front(); };
  EXPECT_GE(weight(told), weight(alone) + learnt.earlier->weight.front());
  EXPECT_GT(learnt.earlier->weight.front(), 10);
}

TEST(Learnt, FrozenFromTheStartNothingIsSolved) {
  for (Mode mode : {Mode::live, Mode::batch})
    for (Method method : {Method::robust, Method::qdmd}) {
      const auto options = options_of(mode, method);
      const Learnt learnt = learnt_by(options);
      Box box(kWidth, kHeight, options);
      box.engine.set_freeze(true);
      ASSERT_TRUE(box.engine.learn_from(learnt).ok());
      size_t frames = 0;
      const auto see = [&](const std::vector<std::vector<uint8_t>>& pictures) {
        for (const auto& picture : pictures) {
          EXPECT_EQ(planes_of(learnt), picture) << frames;
          ++frames;
        }
      };
      for (int t = 0; t < 70; ++t) see(box.push(scene(20)));
      ASSERT_TRUE(box.engine.drain().ok());
      see(box.pop());
      EXPECT_EQ(70u, frames);
      EXPECT_EQ(0u, box.engine.solves());
      box.engine.set_freeze(false);
      for (int t = 0; t < 70; ++t) box.push(walking(t));
      EXPECT_GT(box.engine.solves(), 0u);
    }
}

TEST(Learnt, WhileABatchWaitsEveryFrameLeaves) {
  const auto options = options_of(Mode::batch, Method::robust);
  const Learnt learnt = learnt_by(options);
  for (int at : {0, 1, 15, 29, 30, 31, 44, 59, 60}) {
    Box box(kWidth, kHeight, options);
    size_t frames = 0;
    for (int t = 0; t < 75; ++t) {
      if (t == at) {
        ASSERT_TRUE(box.engine.learn_from(learnt).ok());
      }
      if (t == at && at < 30) {
        EXPECT_EQ(planes_of(learnt), box.background());
      }
      for (const auto& picture : box.push(walking(t))) {
        ++frames;
        EXPECT_LT(mean_distance(picture, empty_scene()), 4) << at << " " << t;
      }
    }
    ASSERT_TRUE(box.engine.drain().ok());
    frames += box.pop().size();
    EXPECT_EQ(75u, frames) << at;
    EXPECT_EQ(3u, box.engine.solves()) << at;
  }
}

TEST(Learnt, FlushForgetsIt) {
  for (Mode mode : {Mode::live, Mode::batch}) {
    const auto options = options_of(mode, Method::robust);
    Box box(kWidth, kHeight, options);
    ASSERT_TRUE(box.engine.learn_from(learnt_by(options)).ok());
    box.engine.flush();
    Learnt learnt;
    EXPECT_FALSE(box.engine.learnt(&learnt));
  }
}

// What one method saved, another takes: the picture, and no more than it can use.
TEST(Learnt, MethodsExchangeFiles) {
  const Learnt robust = learnt_by(options_of(Mode::live, Method::robust));
  const Learnt plain = learnt_by(options_of(Mode::live, Method::qdmd));
  Box first(kWidth, kHeight, options_of(Mode::live, Method::qdmd));
  ASSERT_TRUE(first.engine.learn_from(robust).ok());
  EXPECT_EQ(planes_of(robust), first.push(scene(20))[0]);
  EXPECT_FALSE(first.learnt().earlier.has_value());
  Box second(kWidth, kHeight, options_of(Mode::live, Method::robust));
  ASSERT_TRUE(second.engine.learn_from(plain).ok());
  EXPECT_LT(mean_distance(planes_of(plain), second.push(scene(20))[0]), 4);
  EXPECT_FALSE(second.learnt().earlier.has_value());
}

}  // namespace
}  // namespace qdmd::test
