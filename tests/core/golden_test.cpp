// SPDX-License-Identifier: LGPL-2.1-or-later
// One input gives one set of bytes: for any number of threads, in every run, with each
// instruction set of this machine, in every kind of build. Hashes of what scenes gave are in
// golden.txt; who changes pictures on purpose writes it anew:
//   rm tests/core/golden.txt; QDMD_GOLDEN=tests/core/golden.txt build/tests/core/golden_test
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "core/scene/scene.h"
#include "tests/core/engine_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 77, kHeight = 59, kFrames = 25;
constexpr const char* kScenes[] = {"noise=4", "light-switch,shadow", "trees,jitter=1.5"};

class Hash {
 public:
  void add(const std::vector<uint8_t>& bytes) {
    for (uint8_t byte : bytes) value_ = (value_ ^ byte) * 0x100000001b3;
  }
  std::string text() const {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value_));
    return text;
  }

 private:
  uint64_t value_ = 0xcbf29ce484222325;
};

struct Trial {
  const char* name;
  Mode mode;
  Method method;
  Output output;
  Stabilize stabilize = Stabilize::off;
  int softness = 0;
  Solver solver = Solver::automatic;
};
constexpr Trial kTrials[] = {
    {"qdmd", Mode::batch, Method::qdmd, Output::background},
    {"qdmd-extended", Mode::batch, Method::qdmd, Output::background, Stabilize::off, 0,
     Solver::gram_extended},
    {"qdmd-qr", Mode::batch, Method::qdmd, Output::foreground, Stabilize::off, 0, Solver::qr},
    {"dmd", Mode::batch, Method::dmd, Output::background},
    {"robust", Mode::batch, Method::robust, Output::background},
    {"robust-mask", Mode::batch, Method::robust, Output::mask},
    {"robust-soft", Mode::batch, Method::robust, Output::cutout, Stabilize::off, 4},
    {"live", Mode::live, Method::robust, Output::background},
    {"live-mask", Mode::live, Method::robust, Output::mask, Stabilize::translation},
    {"live-turned", Mode::live, Method::robust, Output::background, Stabilize::similarity},
    {"live-qdmd", Mode::live, Method::qdmd, Output::foreground},
};

std::vector<PackedPicture> rendered(const char* text) {
  scene::SceneOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.seed = 25;
  options.frames_per_second = 5;  // things take their time
  scene::Scene scene(options, text);
  std::vector<PackedPicture> frames;
  for (int t = 0; t < kFrames; ++t) {
    scene.render(t, scene::kFrame);
    PackedPicture picture(kWidth, kHeight, 3);
    std::copy_n(scene.frame().samples.begin(), picture.bytes.size(), picture.bytes.begin());
    frames.push_back(std::move(picture));
  }
  return frames;
}

// Scenes that were rendered elsewhere (tests/neon.sh): the environment names a folder in which
// their frames are, or where they are put.
std::vector<PackedPicture> footage(const char* text) {
  const char* const folder = std::getenv("QDMD_GOLDEN_FRAMES");
  if (!folder) return rendered(text);
  const std::string name = std::string(folder) + "/" + text + ".raw";
  std::vector<PackedPicture> frames(kFrames, PackedPicture(kWidth, kHeight, 3));
  if (std::ifstream file(name, std::ios::binary); file) {
    for (PackedPicture& frame : frames)
      file.read(reinterpret_cast<char*>(frame.bytes.data()), ptrdiff_t(frame.bytes.size()));
    EXPECT_TRUE(file) << name;
    return frames;
  }
  frames = rendered(text);
  std::ofstream file(name, std::ios::binary);
  for (const PackedPicture& frame : frames)
    file.write(reinterpret_cast<const char*>(frame.bytes.data()), ptrdiff_t(frame.bytes.size()));
  EXPECT_TRUE(file.flush()) << name;
  return frames;
}

// All that leaves, one picture after the other.
std::vector<uint8_t> output_of(std::vector<PackedPicture> frames, const Trial& trial, int threads) {
  EngineOptions options;
  options.mode = trial.mode;
  options.method = trial.method;
  options.window_size = 12;
  options.stabilize = trial.stabilize;
  options.mask_softness = trial.softness;
  options.dmd.solver = trial.solver;
  options.threads = threads;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  std::vector<uint8_t> all;
  const auto take = [&] {
    while (engine.next()) {
      PackedPicture out(kWidth, kHeight, 3);
      engine.next()->pop(trial.output, out.out());
      all.insert(all.end(), out.bytes.begin(), out.bytes.end());
    }
  };
  for (PackedPicture& frame : frames) {
    EXPECT_TRUE(engine.push(frame.in()).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  return all;
}

std::string hash_of(const std::vector<uint8_t>& bytes) {
  Hash hash;
  hash.add(bytes);
  return hash.text();
}

std::string frames_hash(const std::vector<PackedPicture>& frames) {
  Hash hash;
  for (const PackedPicture& frame : frames) hash.add(frame.bytes);
  return hash.text();
}

// By "scene run".
std::map<std::string, std::string> golden() {
  std::map<std::string, std::string> hashes;
  std::ifstream file(QDMD_GOLDEN_FILE);
  std::string scene, run, hash;
  while (file >> scene >> run >> hash) hashes[scene + " " + run] = hash;
  return hashes;
}

// Processors of before 2013 round the products of L(t) before they are summed up.
constexpr int64_t kWithoutFused = HWY_SSSE3 | HWY_SSE4 | HWY_SCALAR | HWY_EMU128
#ifdef HWY_SSE2  // Highway 1.2 has passes for it.
                                  | HWY_SSE2
#endif
    ;

// Levels that are a hair from a half go up or down; pixels at a threshold follow them.
void expect_near(const std::vector<uint8_t>& bytes, const std::vector<uint8_t>& reference) {
  ASSERT_EQ(bytes.size(), reference.size());
  size_t other = 0;
  for (size_t i = 0; i < bytes.size(); ++i) other += bytes[i] != reference[i];
  EXPECT_LE(static_cast<double>(other), 1e-4 * static_cast<double>(bytes.size()));
  if (other)
    std::printf("%s: %zu of %zu bytes are other ones\n", hwy::TargetName(hwy::SupportedTargets()),
                other, bytes.size());
}

class Golden : public testing::TestWithParam<const char*> {};

TEST_P(Golden, BytesOfAnyThreadsAndInstructionSet) {
  const std::string scene = GetParam();
  const auto frames = footage(GetParam());
  const auto expected = golden();
  const auto at = [&](const std::string& run) {
    const auto found = expected.find(scene + " " + run);
    return found == expected.end() ? std::string("nothing") : found->second;
  };
  if (const char* name = std::getenv("QDMD_GOLDEN")) {
    std::ofstream file(name, std::ios::app);
    file << scene << " frames " << frames_hash(frames) << "\n";
    for (const Trial& trial : kTrials)
      file << scene << " " << trial.name << " " << hash_of(output_of(frames, trial, 1)) << "\n";
    return;
  }
  std::map<std::string, std::vector<uint8_t>> reference;
  // What the others are of.
  ASSERT_EQ(frames_hash(frames), at("frames")) << scene;
  on_every_target([&] {
    for (const Trial& trial : kTrials) {
      const bool fused = !(hwy::SupportedTargets() & kWithoutFused);
      const bool newest = hwy::SupportedTargets() == *hwy::SupportedAndGeneratedTargets().begin();
      for (int threads : newest ? std::vector{1, 3} : std::vector{2}) {
        const auto bytes = output_of(frames, trial, threads);
        SCOPED_TRACE(scene + " " + trial.name + ", " + std::to_string(threads) + " threads");
        if (fused)
          EXPECT_EQ(hash_of(bytes), at(trial.name));
        else
          expect_near(bytes, reference[trial.name]);
        if (newest) reference[trial.name] = bytes;
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Scenes, Golden, testing::ValuesIn(kScenes));

}  // namespace
}  // namespace qdmd::test
