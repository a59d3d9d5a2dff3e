// Members of a team that share pictures get what one process gets of whole ones, to the last bit.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/engine/engine.h"
#include "tests/core/engine_util.h"
#include "tests/core/thread_team.h"

namespace qdmd::test {
namespace {

constexpr Output kOutputs[] = {Output::background, Output::foreground, Output::mask,
                               Output::cutout};

// A noisy wall with a box that crosses all bands, leaves that move in one corner, a shadow, and
// somebody who comes and stays.
struct Street {
  int width, height;
  double noise = 2;
  bool fade = false;

  std::vector<uint8_t> frame(int t) const {
    std::mt19937 rng(static_cast<unsigned>(1000 + t));
    std::normal_distribution<float> random(0, static_cast<float>(noise));
    const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    std::vector<uint8_t> planes(3 * pixels);
    const double light = fade ? 1 - 0.3 * std::min(t, 30) / 30.0 : 1;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const bool box =
            std::abs(y - (t * 7) % height) < height / 6 && std::abs(x - (t * 5) % width) < 12;
        const bool shadow = !box && std::abs(y - (t * 7) % height) < height / 5 &&
                            std::abs(x - 20 - (t * 5) % width) < 10;
        const bool leaves = x < width / 3 && y > height / 2;
        const bool stays =
            t > 12 && std::abs(y - height / 2) < 9 && std::abs(x - width * 3 / 4) < 7;
        for (int c = 0; c < 3; ++c) {
          double level = 60 + (x * 3 + y * 2 + c * 31) % 97 + 20 * ((x / 9 + y / 7) % 2);
          if (leaves) level = 70 + 60 * ((x + (t * (3 + y % 3)) % 4) / 2 % 2) + 5 * c;
          if (shadow) level *= 0.7;
          if (stays) level = 210 - 40 * c;
          if (box) level = 30 + 90 * c;
          planes[static_cast<size_t>(c) * pixels + static_cast<size_t>(y * width + x)] =
              static_cast<uint8_t>(std::lround(
                  std::clamp(level * light + static_cast<double>(random(rng)), 0.0, 255.0)));
        }
      }
    return planes;
  }
};

// What a run gives: for each frame the pictures, own rows only; and of each solve what it says.
struct Results {
  std::vector<std::vector<uint8_t>> pictures;
  std::vector<std::vector<uint8_t>> masks;  // of whole pictures
  std::vector<double> said;
  std::vector<uint8_t> background;
  bool operator==(const Results&) const = default;
};

struct Case {
  const char* name;
  Street street;
  EngineOptions options;
  int frames;
  int64_t absorb = 0;
  bool anew = false;  // each window by itself
  IgnoredAreas ignored = {};
  Shadows shadows = Shadows::background;
};

// Rows first .. first + count - 1.
std::vector<uint8_t> rows_of(PackedPicture& picture, int first, int count) {
  const auto begin = picture.bytes.begin() + first * picture.row_stride;
  return {begin, begin + count * picture.row_stride};
}

// The kept rows of a frame, whose pixels share samples as the options say: that of the first one.
struct KeptRows {
  std::vector<uint8_t> channel[3];
  ImageView view;

  KeptRows(const Street& street, int t, const Band& band, const EngineOptions& options) {
    const std::vector<uint8_t> planes = street.frame(t);
    const size_t pixels = static_cast<size_t>(street.width) * static_cast<size_t>(street.height);
    view.width = street.width;
    view.height = band.rows();
    for (size_t c = 0; c < 3; ++c) {
      const int columns = c > 0 ? options.chroma_columns : 1,
                rows = c > 0 ? options.chroma_rows : 1;
      EXPECT_EQ(band.first() % rows, 0) << "pixels that share a sample are in two bands";
      for (int y = band.first(); y < band.first() + band.rows(); y += rows)
        for (int x = 0; x < street.width; x += columns)
          channel[c].push_back(planes[c * pixels + static_cast<size_t>(y * street.width + x)]);
      view.channel[c] = channel[c].data();
      view.own[c] = {1, (street.width + columns - 1) / columns, columns, rows};
    }
  }
};

Results run(const Case& c, Team* team) {
  EngineOptions options = c.options;
  options.team = team;
  options.shadows = c.shadows;
  Results results;
  Engine engine;
  const Status status = engine.configure(options, c.street.width, c.street.height);
  EXPECT_TRUE(status.ok()) << status.message;
  if (!status.ok()) return results;
  Wishes wishes = first_wishes(options);
  wishes.absorb_frames = c.absorb;
  wishes.ignored = c.ignored;
  const Band& band = engine.plan().band();
  PackedPicture out(c.street.width, band.rows());
  uint64_t solves = 0;
  const auto take = [&] {
    while (engine.next()) {
      for (Output output : kOutputs) {
        engine.next()->write(output, {}, out.out());
        results.pictures.push_back(rows_of(out, band.own_begin(), band.own_rows()));
      }
      const uint8_t* const mask = engine.next()->whole_mask();
      results.masks.emplace_back(mask, mask + c.street.width * c.street.height);
      engine.next()->skip();
      if (engine.report().solves == solves) continue;
      solves = engine.report().solves;
      const SolveReport report = engine.report().solve;
      for (double value :
           {report.dmd.lambda.real(), report.dmd.lambda.imag(), report.dmd.omega,
            report.dmd.residual, report.dmd.condition, report.dmd.rounding_bound,
            report.dmd.sensitivity, static_cast<double>(report.dmd.rank), report.foreground.noise,
            report.foreground.threshold, report.foreground.ratio})
        results.said.push_back(value);
    }
  };
  for (int t = 0; t < c.frames; ++t) {
    EXPECT_TRUE(engine.push(KeptRows(c.street, t, band, options).view).ok());
    if (c.anew && (t + 1) % options.window_size == 0 && t + 1 < c.frames) {
      EXPECT_TRUE(engine.drain().ok());
      take();
      engine.begin_anew();
    }
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  EXPECT_TRUE(engine.write_background(out.out()));
  results.background = rows_of(out, band.own_begin(), band.own_rows());
  return results;
}

// The members' rows, put together.
Results run_shared(const Case& c, int size) {
  std::vector<Results> parts(static_cast<size_t>(size));
  run_team(size,
           [&](ThreadTeam* team) { parts[static_cast<size_t>(team->rank())] = run(c, team); });
  Results whole = parts.front();
  for (size_t r = 1; r < parts.size(); ++r) {
    EXPECT_EQ(parts[r].said, whole.said);
    EXPECT_TRUE(parts[r].masks == whole.masks) << "member " << r;
    if (parts[r].pictures.size() != whole.pictures.size()) {
      ADD_FAILURE() << "member " << r << " has other pictures";
      continue;
    }
    for (size_t i = 0; i < whole.pictures.size(); ++i)
      whole.pictures[i].insert(whole.pictures[i].end(), parts[r].pictures[i].begin(),
                               parts[r].pictures[i].end());
    whole.background.insert(whole.background.end(), parts[r].background.begin(),
                            parts[r].background.end());
  }
  return whole;
}

void expect_shared_as_whole(const Case& c, std::initializer_list<int> sizes) {
  const Results alone = run(c, nullptr);
  ASSERT_EQ(alone.pictures.size(), std::size(kOutputs) * static_cast<size_t>(c.frames)) << c.name;
  for (int size : sizes) {
    const Results shared = run_shared(c, size);
    EXPECT_EQ(shared.said, alone.said) << c.name << ", " << size << " members";
    EXPECT_TRUE(shared.masks == alone.masks) << c.name << ", " << size << " members";
    EXPECT_EQ(shared.background, alone.background) << c.name << ", " << size << " members";
    ASSERT_EQ(shared.pictures.size(), alone.pictures.size());
    for (size_t i = 0; i < alone.pictures.size(); ++i) {
      if (shared.pictures[i] == alone.pictures[i]) continue;
      size_t p = 0;
      while (shared.pictures[i][p] == alone.pictures[i][p]) ++p;
      ADD_FAILURE() << c.name << ", " << size << " members: frame " << i / std::size(kOutputs)
                    << ", output " << i % std::size(kOutputs) << ", row "
                    << p / (4 * static_cast<size_t>(c.street.width));
      break;
    }
  }
}

EngineOptions options_of(Method method, int window) {
  EngineOptions options;
  options.method = method;
  options.window_size = window;
  options.threads = 1;
  options.remembers = false;
  return options;
}

TEST(Band, QdmdOfSharedPicturesIsThatOfWholeOnes) {
  expect_shared_as_whole({"qdmd", {129, 125}, options_of(Method::qdmd, 12), 30}, {1, 2, 3, 4});
}

TEST(Band, DmdOfSharedPicturesIsThatOfWholeOnes) {
  expect_shared_as_whole({"dmd", {130, 121}, options_of(Method::dmd, 11), 25}, {2, 3});
}

TEST(Band, QdmdSamplesAndLowRank) {
  EngineOptions options = options_of(Method::qdmd, 10);
  options.sample_step = 4;
  options.dmd.rank = 3;
  options.dmd.omega_threshold = 0.5;
  expect_shared_as_whole({"samples", {83, 79}, options, 23}, {3, 5});
}

TEST(Band, DirectCombinationOfManyModes) {
  EngineOptions options = options_of(Method::qdmd, 8);
  options.dmd.omega_threshold = 4;
  expect_shared_as_whole({"many modes", {61, 57}, options, 17}, {2, 4});
}

TEST(Band, RobustOfSharedPicturesIsThatOfWholeOnes) {
  expect_shared_as_whole({"robust", {161, 135}, options_of(Method::robust, 20), 50}, {1, 2, 3, 4});
}

TEST(Band, PixelsThatShareChroma) {
  for (Method method : {Method::qdmd, Method::dmd, Method::robust})
    for (int rows : {1, 2}) {
      EngineOptions options = options_of(method, 12);
      options.colours = Colours::yuv;
      options.chroma_columns = 2;
      options.chroma_rows = rows;
      // Rows of cells are two or three pixels high: some begin inside of a sample.
      const Case c = {"chroma", {129, 125}, options, 30};
      expect_shared_as_whole(c, {1, 2, 3, 4});
      options.sample_step = 3;
      expect_shared_as_whole({"chroma, samples", {65, 43}, options, 20}, {2, 5});
    }
}

TEST(Band, RobustWithLargeNeighbourhoods) {
  // The background is searched two pixels apart, and two pixels vote.
  expect_shared_as_whole({"large", {500, 481}, options_of(Method::robust, 12), 12}, {2, 3});
}

TEST(Band, RobustInLightThatChanges) {
  Street street = {128, 123};
  street.fade = true;
  EngineOptions options = options_of(Method::robust, 110);
  expect_shared_as_whole({"fade, every second frame", street, options, 115}, {3});
  options.window_size = 40;
  options.iterations = 3;
  expect_shared_as_whole({"fade, three iterations", street, options, 50}, {2, 4});
}

TEST(Band, RobustInNoiseAndWithWhatStays) {
  Street street = {131, 127, 14};
  expect_shared_as_whole({"means", street, options_of(Method::robust, 16), 40, 6}, {2, 3});
  street.noise = 2;
  expect_shared_as_whole({"absorbed", street, options_of(Method::robust, 30), 70, 15}, {4});
}

TEST(Band, WindowsByThemselves) {
  const EngineOptions options = options_of(Method::robust, 16);
  expect_shared_as_whole({"anew", {127, 123}, options, 41, 0, true}, {2, 3});
}

TEST(Band, IgnoredAreasAndMarkedShadows) {
  Case c = {"ignored", {140, 133}, options_of(Method::robust, 18), 30};
  c.ignored.add({20, 30, 50, 70});
  c.ignored.add({-5, 120, 40, 90});
  c.shadows = Shadows::marked;
  expect_shared_as_whole(c, {3});
  c.options.foreground_threshold = 25;
  expect_shared_as_whole(c, {2});
}

TEST(Band, ThreadsOfMembersChangeNothing) {
  EngineOptions options = options_of(Method::robust, 14);
  options.threads = 3;
  expect_shared_as_whole({"threads", {200, 190}, options, 20}, {2});
}

// Windows by themselves are what a stream of each of them gives.
TEST(Band, BeginsAnewLikeAnotherStream) {
  Case c = {"stream", {97, 91}, options_of(Method::robust, 12), 36};
  c.anew = true;
  const Results all = run(c, nullptr);
  for (int window = 0; window < 3; ++window) {
    Engine engine;
    ASSERT_TRUE(engine.configure(c.options, 97, 91).ok());
    PackedPicture out(97, 91);
    for (int t = 0; t < 12; ++t)
      ASSERT_TRUE(
          engine.push(KeptRows(c.street, 12 * window + t, engine.plan().band(), c.options).view)
              .ok());
    ASSERT_TRUE(engine.drain().ok());
    for (int t = 0; t < 12; ++t) {
      for (size_t k = 0; k < std::size(kOutputs); ++k) {
        engine.next()->write(kOutputs[k], {}, out.out());
        EXPECT_TRUE(out.bytes ==
                    all.pictures[std::size(kOutputs) * static_cast<size_t>(12 * window + t) + k])
            << window << " " << t;
      }
      engine.next()->skip();
    }
  }
}

TEST(Band, RefusesWhatNeedsTheWholePicture) {
  run_team(2, [](ThreadTeam* team) {
    EngineOptions options = options_of(Method::qdmd, 8);
    options.team = team;
    Engine engine;
    options.dmd.solver = Solver::qr;
    EXPECT_FALSE(engine.configure(options, 64, 64).ok());
    options.dmd.solver = Solver::gram;
    options.mask_softness = 2;
    EXPECT_FALSE(engine.configure(options, 64, 64).ok());
    options.mask_softness = 0;
    options.mode = Mode::live;
    EXPECT_FALSE(engine.configure(options, 64, 64).ok());
    options.mode = Mode::batch;
    options.method = Method::robust;
    options.remembers = true;
    EXPECT_FALSE(engine.configure(options, 64, 64).ok());
    options.method = Method::qdmd;
    EXPECT_FALSE(engine.configure(options, 64, 1).ok()) << "there are more members than rows";
    EXPECT_TRUE(engine.configure(options, 64, 2).ok());
    options.colours = Colours::yuv;
    options.chroma_columns = options.chroma_rows = 2;
    EXPECT_FALSE(engine.configure(options, 64, 2).ok()) << "both rows have the same chroma";
    EXPECT_TRUE(engine.configure(options, 64, 3).ok());
  });
}

// Each row is somebody's own, and only rows around the own ones are kept besides. Pixels that share
// a sample stay together.
TEST(Band, OwnRowsCoverThePicture) {
  // Heights, and processes that can share them.
  for (const auto& [height, most] : {std::pair{7, 1}, {48, 2}, {97, 7}, {1080, 7}})
    for (int size = 1; size <= most; ++size)
      for (int together : {1, 2}) {
        std::vector<int> owners(static_cast<size_t>(height));
        run_team(size, [&, height = height](ThreadTeam* team) {
          EngineOptions options = options_of(Method::robust, 8);
          options.team = team;
          options.colours = Colours::yuv;
          options.chroma_rows = together;
          const EnginePlan plan(options, 1920, height);
          EXPECT_TRUE(plan.status().ok()) << plan.status().message;
          const Band& band = plan.band();
          EXPECT_EQ(band.height(), height);
          for (int y = band.own_first(); y < band.own_end(); ++y) ++owners[static_cast<size_t>(y)];
          EXPECT_GE(band.own_begin(), 0);
          EXPECT_LE(band.own_begin() + band.own_rows(), band.rows());
          EXPECT_LE(band.first() + band.rows(), height);
          EXPECT_EQ(band.first() % together, 0);
          EXPECT_EQ(band.own_begin() % together, 0);
          if (band.own_end() < height) {
            EXPECT_EQ(band.own_end() % together, 0);
          }
        });
        for (int owner : owners) EXPECT_EQ(owner, 1);
      }
}

}  // namespace
}  // namespace qdmd::test
