// SPDX-License-Identifier: LGPL-2.1-or-later
// What a background does with a model that has something in it which is not a number.
#include <cmath>

#include "core/engine/background.h"
#include "core/learn/gram_learner.h"
#include "core/model/build_spread.h"
#include "tests/core/engine_util.h"
#include "tests/core/layouts.h"

namespace qdmd::test {
namespace {

// A learner whose models have such a number while `broken`.
class BrokenLearner : public GramLearner {
 public:
  BrokenLearner(const LearnOptions& options, int width, double number, const bool* broken)
      : GramLearner(options, width, 1), number_(number), broken_(broken) {}
  void decompose(const SnapshotRange& snapshots) override {
    GramLearner::decompose(snapshots);
    snapshots_ = snapshots;
  }
  void build(Slice slice, BackgroundModel* model) override {
    GramLearner::build(slice, model);
    if (!*broken_) return;
    QuaternionMatrixd shares(snapshots_->size(), 1);
    shares.a.setConstant(number_);
    TemporalModel bad(snapshots_->size());
    bad.add_mode(shares, 1.0, 0, Quaterniond(1.0));
    model->begin(*snapshots_, bad, true);
    model->build_slice(0, snapshots_->pixels());
  }

 private:
  double number_;
  const bool* broken_;
  std::optional<SnapshotRange> snapshots_;
};

TEST(Background, ModelThatIsNoNumberIsReplacedByTheMean) {
  constexpr int kPixels = 70, kFrames = 4;
  LearnOptions options;
  options.method = Method::qdmd;
  for (Models models : {Models::one, Models::two, Models::two_of_live})
    for (double number : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
      SCOPED_TRACE(number);
      Clock clock;
      Workers workers(1);
      FrameStore frames(kFrames, kPixels, 1, {});
      bool broken = true;
      Background background(std::make_unique<BrokenLearner>(options, kPixels, number, &broken),
                            {&frames, kFrames, models, &workers.pool(), &clock});
      for (int t = 0; t < kFrames; ++t) {
        PackedPicture picture(kPixels, 1);
        for (size_t p = 0; p < kPixels; ++p)
          for (size_t c = 0; c < 3; ++c)
            picture.at(c, p) = static_cast<uint8_t>(p + 20 * c + 40 * static_cast<size_t>(t));
        ASSERT_TRUE(frames.append(picture.in()));
        background.learner().add(frames.window(), 1, {0, 1});
      }
      const auto publish = [&] {
        background.begin(frames.window());
        background.build({0, 1});
        background.finish({});
        background.publish();
        background.model().set_time(2);
      };
      publish();
      EXPECT_TRUE(background.report().replaced);
      EXPECT_FALSE(background.report().dmd.converged);
      EXPECT_TRUE(background.model().is_finite());
      std::vector<uint8_t> out(3 * kPixels);
      uint8_t* const rows[3] = {out.data(), out.data() + kPixels, out.data() + 2 * kPixels};
      background.model().evaluate(0, kPixels, rows);
      for (size_t c = 0; c < 3; ++c)
        for (size_t p = 0; p < kPixels; ++p)
          ASSERT_NEAR(double(out[c * kPixels + p]), double(p + 20 * c) + 60, 1);
      // And the next good one is in use as it is.
      broken = false;
      publish();
      EXPECT_FALSE(background.report().replaced);
      EXPECT_EQ(background.solves(), 2u);
    }
}

// The mean has all bits of samples of more than 8 bits that pixels share.
TEST(Background, MeanOfSharedSamplesOfMoreThanEightBits) {
  constexpr int kWidth = 131, kHeight = 7, kFrames = 4;
  LearnOptions options;
  options.method = Method::qdmd;
  const SampleBits bits = {10, 6};
  const FrameContents contents = {1, 0, 2, 2, bits.depth};
  FrameStore frames(kFrames, kWidth, kHeight, contents);
  const VideoLayout layout = of_words(kVideoLayouts[2]);
  const auto word = [](int t, int c, int x, int y) {
    return (x * 7 + y * 13 + 90 * c) % 700 + 4 * t * (c + 1);
  };
  for (int t = 0; t < kFrames; ++t) {
    VideoPicture picture(layout, kWidth, kHeight, 3, bits);
    for (int c = 0; c < kChannels; ++c)
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const ChannelAt& at = layout.at[static_cast<size_t>(c)];
          picture.put_word(c, x, y, word(t, c, x / at.columns, y / at.rows));
        }
    ASSERT_TRUE(frames.append(picture.view<const uint8_t>()));
  }
  BackgroundModel model;
  model.set_depth(bits.depth);
  Pool pool(2);
  const SnapshotRange whole = frames.window();
  model.begin_from(kFrames, whole.pixels(), mean_of_frames(kFrames));
  build_spread(whole, 0, whole.pixels(), &pool, &model);
  model.set_time(1);
  std::vector<uint16_t> out(3 * whole.pixels());
  uint16_t* const rows[3] = {out.data(), out.data() + whole.pixels(),
                             out.data() + 2 * whole.pixels()};
  for (size_t first = 0; first < whole.pixels(); first += kMaxRun) {
    uint16_t* const at[3] = {rows[0] + first, rows[1] + first, rows[2] + first};
    model.evaluate_deep(first, std::min(kMaxRun, whole.pixels() - first), at);
  }
  for (int c = 0; c < kChannels; ++c)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const ChannelAt& at = layout.at[static_cast<size_t>(c)];
        const int mean = word(0, c, x / at.columns, y / at.rows) + 6 * (c + 1);
        ASSERT_EQ(rows[c][y * kWidth + x], mean) << c << " at " << x << ", " << y;
      }
}

}  // namespace
}  // namespace qdmd::test
