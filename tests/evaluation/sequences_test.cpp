// SPDX-License-Identifier: LGPL-2.1-or-later
// Two real sequences with loose bounds: what the methods made of them must not get worse.
#include <cmath>
#include <set>

#include "tests/evaluation/evaluate_util.h"

namespace qdmd::test {
namespace {

// QDMD_DATA is the folder with SBI; without it these tests are skipped.
class Sequences : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("QDMD_DATA");
    if (!data || !*data) GTEST_SKIP() << "QDMD_DATA is not set";
    sbi_ = fs::path(data) / "SBI";
    ASSERT_TRUE(fs::is_directory(sbi_ / "CaVignal")) << sbi_;
    ASSERT_TRUE(fs::is_directory(sbi_ / "Board")) << sbi_;
  }
  fs::path sbi_;
};

TEST_F(Sequences, StayWithinLooseBounds) {
  const Folder out;
  const Result result =
      evaluate({"--dataset", sbi_.string(), "--sequences", "CaVignal,Board", "--methods",
                "qdmd,dmd,mean,median", "--format", "json", "--output-dir", out.string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto table = result.json();
  ASSERT_EQ(table.size(), 8u);
  for (const auto& row : table) {
    const bool masks = row.at("sequence") == "CaVignal" &&
                       (row.at("method") == "qdmd" || row.at("method") == "dmd");
    for (const auto& [name, value] : row.items()) {
      if (name == "sequence" || name == "method") continue;
      if (!masks && (name == "precision" || name == "recall" || name == "F"))
        EXPECT_TRUE(value.is_null()) << row;
      else
        EXPECT_TRUE(value.is_number() && std::isfinite(value.get<double>())) << name << row;
    }
  }
  const auto age = [&](const char* sequence, const char* method) {
    return row_of(table, sequence, method).at("AGE").get<double>();
  };
  // The man who stands still and the two who cover the board stay in a least-squares background:
  // measured 11.4, 9.5, 27.4, 27.4.
  EXPECT_LT(age("CaVignal", "qdmd"), 12.5);
  EXPECT_LT(age("CaVignal", "dmd"), 11);
  EXPECT_LT(age("Board", "qdmd"), 29);
  EXPECT_LT(age("Board", "dmd"), 29);
  EXPECT_GT(row_of(table, "CaVignal", "qdmd").at("F"), 0.5);
  EXPECT_GT(row_of(table, "CaVignal", "qdmd").at("MSSSIM"), 0.75);

  // The measure, apart from the methods: AGE of the picture that was written, by the formula.
  const cv::Mat truth = cv::imread((sbi_ / "CaVignal/gt/GT_CaVignal.png").string());
  for (const char* method : {"qdmd", "dmd", "mean", "median"}) {
    const cv::Mat written =
        cv::imread((out / (std::string("CaVignal_") + method + ".png")).string());
    ASSERT_EQ(written.size(), truth.size());
    EXPECT_NEAR(age("CaVignal", method), grey_error(written, truth), 0.02) << method;
  }
}

TEST_F(Sequences, OneModeOfRankOneIsNoWorseThanTheMean) {
  const auto table = evaluate({"--dataset", sbi_.string(), "--sequences", "CaVignal,Board",
                               "--methods", "qdmd,mean", "--set", "rank=1", "--format", "json"})
                         .json();
  for (const char* sequence : {"CaVignal", "Board"})
    EXPECT_LT(row_of(table, sequence, "qdmd").at("AGE").get<double>(),
              row_of(table, sequence, "mean").at("AGE").get<double>() + 0.5)
        << sequence;
}

}  // namespace
}  // namespace qdmd::test
