// SPDX-License-Identifier: LGPL-2.1-or-later
// Random streams, and that no effect touches what another one does.
#include <algorithm>
#include <limits>
#include <map>

#include "core/scene/effects/sensor_noise.h"
#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::DrawRecord;
using scene::Scene;
using scene::Stream;
using scene::StreamSource;

// ---- Streams ----

TEST(SceneStream, MixesAsSplitMix64) {
  // The outputs of the published generator from the states 0 and 1234567.
  constexpr uint64_t kStep = 0x9e3779b97f4a7c15u;
  EXPECT_EQ(Stream::mix(kStep), 0xe220a8397b1dcdafu);
  EXPECT_EQ(Stream::mix(2 * kStep), 0x6e789e6aa1b965f4u);
  EXPECT_EQ(Stream::mix(3 * kStep), 0x06c45d188009454fu);
  EXPECT_EQ(Stream::mix(1234567 + kStep), 6457827717110365317u);
  EXPECT_EQ(Stream::mix(1234567 + 2 * kStep), 3203168211198807973u);
}

TEST(SceneStream, RecordsWhatItDrew) {
  constexpr uint64_t kStep = 0x9e3779b97f4a7c15u;
  std::vector<DrawRecord> log;
  std::vector<uint64_t> drawn;
  for (const int draws : {0, 1, 2, 3, 1000}) {
    Stream stream = StreamSource(5, "name", &log).at(draws);
    drawn.clear();
    for (int i = 0; i < draws; ++i) drawn.push_back(stream.next());
  }
  ASSERT_EQ(log.size(), 5u);
  constexpr uint64_t kDraws[] = {0, 1, 2, 3, 1000};
  for (size_t i = 0; i < log.size(); ++i) {
    EXPECT_EQ(log[i].name, "name");
    EXPECT_EQ(log[i].number, static_cast<int64_t>(kDraws[i]));
    EXPECT_EQ(log[i].draws, kDraws[i]);
  }
  for (uint64_t i = 0; i < 1000; ++i)
    ASSERT_EQ(drawn[i], Stream::mix(log[4].first_state + (i + 1) * kStep));
  // Each of these draws once.
  {
    Stream stream = StreamSource(5, "name", &log).at(9);
    stream.uniform();
    stream.uniform(2, 3);
    stream.index(4);
  }
  EXPECT_EQ(log.back().draws, 3u);
  { Stream quiet = StreamSource(5, "name", &log).unlogged(9); }
  EXPECT_EQ(log.size(), 6u);
}

TEST(SceneStream, SeedNameAndNumberAllCount) {
  std::vector<DrawRecord> log;
  for (const uint64_t seed : {uint64_t{0}, uint64_t{1}, ~uint64_t{0}})
    for (const char* name : {"", "a", "b", "ab", "ba"})
      for (const int64_t number : {-2, -1, 0, 1, 2}) StreamSource(seed, name, &log).at(number);
  std::vector<uint64_t> states;
  for (const auto& record : log) states.push_back(record.first_state);
  std::sort(states.begin(), states.end());
  EXPECT_EQ(std::unique(states.begin(), states.end()), states.end());
  EXPECT_EQ(states.size(), 75u);
}

TEST(SceneStream, UniformNumbers) {
  constexpr int kCount = 200000;
  Stream stream = StreamSource(3, "uniform").at(0);
  double sum = 0, squares = 0, products = 0, last = 0;
  std::array<int, 7> bins{};
  for (int i = 0; i < kCount; ++i) {
    const double u = stream.uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    sum += u - 0.5, squares += (u - 0.5) * (u - 0.5), products += (u - 0.5) * last;
    last = u - 0.5;
    const int bin = stream.index(7);
    ASSERT_TRUE(bin >= 0 && bin < 7);
    ++bins[static_cast<size_t>(bin)];
  }
  // 4.5 sigma each: variances 1/12 of u, 1/180 of u^2, 1/144 of a product of two.
  const double n = kCount;
  EXPECT_NEAR(sum / n, 0, 4.5 * std::sqrt(1 / 12.0 / n));
  EXPECT_NEAR(squares / n, 1 / 12.0, 4.5 * std::sqrt(1 / 180.0 / n));
  EXPECT_NEAR(products / n, 0, 4.5 * std::sqrt(1 / 144.0 / n));
  for (const int count : bins) EXPECT_NEAR(count, n / 7, 4.5 * std::sqrt(n * 6 / 49));
}

TEST(NormalQuantiles, AgreeWithTheErrorFunction) {
  for (const int size : {2, 3, 8, 101, 4096, 65536}) {
    const auto quantiles = scene::normal_quantiles(size);
    ASSERT_EQ(quantiles.size(), static_cast<size_t>(size));
    double squares = 0, exact_squares = 0;
    std::vector<double> exact;
    for (int i = 0; i < size; ++i) {
      // Bisection of the distribution function, by its smaller tail.
      const double p = (i + 0.5) / size, tail = std::min(p, 1 - p);
      double low = 0, high = 40;
      for (int step = 0; step < 70; ++step) {
        const double middle = (low + high) / 2;
        (0.5 * std::erfc(middle / std::sqrt(2.0)) > tail ? low : high) = middle;
      }
      exact.push_back(p < 0.5 ? -low : low);
      exact_squares += low * low;
    }
    const double scale = std::sqrt(size / exact_squares);
    for (size_t i = 0; i < exact.size(); ++i) {
      // Rounded to float, 2^-24 of at most 8, after a few roundings of doubles.
      EXPECT_NEAR(quantiles[i], exact[i] * scale, 5e-7) << size << ' ' << i;
      EXPECT_EQ(quantiles[i], -quantiles[exact.size() - 1 - i]) << size << ' ' << i;
      squares += static_cast<double>(quantiles[i]) * quantiles[i];
    }
    EXPECT_NEAR(squares / size, 1, 1e-6) << size;
  }
  EXPECT_EQ(scene::normal_quantiles(1), std::vector<float>{0});
  EXPECT_NEAR(scene::normal_quantiles(65536).back(), 4.3, 0.05);
}

// ---- Independence ----

std::vector<DrawRecord> draws_of(const std::string& text) {
  std::vector<DrawRecord> log;
  auto how = options(32, 24, 4);
  how.draw_log = &log;
  Scene scene(how, text);
  for (int64_t k = 0; k < 30; k += 3) scene.render(k, kEverything);
  return log;
}

std::vector<DrawRecord> without(std::vector<DrawRecord> log, const std::string& name) {
  std::erase_if(log, [&](const DrawRecord& record) { return record.name == name; });
  return log;
}

// Rain and snow fill the canvas, whose size follows from the effects that look beside the frame.
bool margin_matters(const std::string& effect, const std::string& other) {
  return (effect == "jitter" || effect == "defocus") && (other == "rain" || other == "snow");
}

// A frozen picture is that of another frame, and low-rate decides which frames fall into a
// disturbance: which streams two such scenes ask for differs, and what each of them draws does not.
bool same_streams(const std::vector<DrawRecord>& a, const std::vector<DrawRecord>& b) {
  std::map<std::pair<std::string, int64_t>, DrawRecord> streams;
  for (const auto& record : a) streams.insert({{record.name, record.number}, record});
  return std::all_of(b.begin(), b.end(), [&](const DrawRecord& record) {
    return streams.insert({{record.name, record.number}, record}).first->second == record;
  });
}

void expect_same_draws(const std::string& effect, const std::string& other) {
  const auto alone = draws_of(other), both = draws_of(other + ',' + effect);
  EXPECT_FALSE(alone.empty());
  const auto others = without(both, effect);
  const bool other_frames = effect == "frozen" || effect == "low-rate";
  const bool same = other_frames ? same_streams(alone, others) : others == alone;
  EXPECT_TRUE(same) << effect << " changes the draws of " << other;
}

TEST(SceneIndependence, NoEffectChangesTheDrawsOfAnother) {
  for (const auto& effect : effect_names()) {
    expect_same_draws(effect, "default");
    for (const auto& other : effect_names())
      if (other != effect && !margin_matters(effect, other)) expect_same_draws(effect, other);
  }
}

// Rain and snow draw as many drops and flakes as the canvas holds, margin included.
TEST(SceneIndependence, TheMarginDoesNotChangeTheWeather) {
  for (const char* effect : {"jitter", "defocus"})
    for (const char* other : {"rain", "snow"}) expect_same_draws(effect, other);
}

TEST(SceneIndependence, OnlyEffectsThatNeedRandomNumbersDraw) {
  const auto plain = draws_of("default");
  for (const auto& record : plain)
    EXPECT_TRUE(record.name == "backdrop" || record.name == "mover") << record.name;
  for (const scene::EffectInfo* info : scene::effects()) {
    uint64_t draws = 0, records = 0, others = 0;
    for (const auto& record : draws_of(info->name)) {
      const bool own = record.name == info->name;
      records += own;
      draws += own ? record.draws : 0;
      others += !own && record.name != "backdrop" && record.name != "mover";
    }
    if (info->needs & scene::kRandom)
      EXPECT_GT(draws, 0u) << info->name;
    else
      EXPECT_EQ(records, 0u) << info->name;
    EXPECT_EQ(others, 0u) << info->name;
  }
}

TEST(SceneIndependence, OnlyEffectsThatNeedAWarpEnlargeTheCanvas) {
  for (const scene::EffectInfo* info : scene::effects()) {
    std::vector<double> values;
    for (const auto& parameter : info->parameters) values.push_back(parameter.standard);
    const auto effect = info->make(values, StreamSource(1, info->name));
    EXPECT_EQ(effect->margin(320, 240) > 0, (info->needs & scene::kWarp) != 0) << info->name;
  }
}

// At these values an effect does nothing at all; one that enlarges the canvas stands apart.
constexpr const char* kNothing[] = {"low-rate=4",
                                    "stop=0",
                                    "abandon:seconds=0",
                                    "clutter=0",
                                    "foliage=0",
                                    "leaves=0",
                                    "trees=0",
                                    "flicker=0",
                                    "shadow:length=0",
                                    "mirror=0",
                                    "motion-blur=0",
                                    "rain=0",
                                    "rain:brightness=0",
                                    "snow=0",
                                    "defocus=0",
                                    "fade=0",
                                    "light-switch=0",
                                    "bands=0",
                                    "exposure=0",
                                    "noise=0",
                                    "length=1000",
                                    "fog=0",
                                    "focus-search=0",
                                    "lost-blocks=0",
                                    "smear:seconds=0",
                                    "frozen:seconds=0",
                                    "lost-signal:seconds=0",
                                    "lamp=0",
                                    "headlights=0",
                                    "cloud=0",
                                    "infrared:seconds=0"};

void expect_no_change(const std::string& nothing, const std::string& name) {
  // Two effects of one name are one.
  const std::string effect = nothing.substr(0, nothing.find_first_of(":="));
  for (const auto& named : scene::parse_scene(name))
    if (named.info->name == effect) return;
  Scene with(options(48, 36, 4), name + ',' + nothing), plain(options(48, 36, 4), name);
  for (const int64_t k : {0, 1, 11, 18, 23, 24, 25}) {
    Shot a = shoot(&with, k), b = shoot(&plain, k);
    // Bands of no depth are rows of ones.
    if (effect == "bands" &&
        std::all_of(a.rows.begin(), a.rows.end(), [](double factor) { return factor == 1; }))
      a.rows.clear();
    EXPECT_TRUE(a == b) << nothing << " changes " << name << " at frame " << k;
  }
}

TEST(SceneIndependence, AnEffectOfNoStrengthChangesNothing) {
  for (const char* nothing : kNothing)
    for (const auto& name : scene_names()) expect_no_change(nothing, name);
}

// What fills the canvas or is measured on all of it.
constexpr const char* kSeesTheMargin[] = {
    "leaves",           "water", "rain", "snow", "exposure", "storm", "illumination-changes",
    "background-motion"};

TEST(SceneIndependence, ACanvasLargerThanTheFrameChangesNothing) {
  for (const auto& name : scene_names())
    if (std::find(std::begin(kSeesTheMargin), std::end(kSeesTheMargin), name) ==
        std::end(kSeesTheMargin))
      expect_no_change("jitter=0", name);
}

// Twigs are counted from the canvas's corner, waves clamped at its edge, weather spread over it,
// and the exposure's target is its mean, so that jitter=0, with a margin of 1, changes them.
TEST(SceneIndependence, ACanvasLargerThanTheFrameChangesNothingInTheseEither) {
  for (const char* name : kSeesTheMargin)
    if (std::string(name) != "storm") expect_no_change("jitter=0", name);
}

}  // namespace
}  // namespace qdmd::test
