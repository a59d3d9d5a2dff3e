// SPDX-License-Identifier: LGPL-2.1-or-later
// Robust Q-DMD on real sequences: at most 300 frames of each, evenly thinned, in one window.
#include <map>

#include "tests/evaluation/evaluate_util.h"

namespace qdmd::test {
namespace {

using Table = nlohmann::json;

// QDMD_DATA is the folder with SBI, SBMnet and CDnet; without it these tests are skipped. What
// several tests look at is measured once.
class RobustSequences : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("QDMD_DATA");
    if (!data || !*data) GTEST_SKIP() << "QDMD_DATA is not set";
    data_ = data;
    ASSERT_TRUE(fs::is_directory(data_ / "SBI")) << data_;
  }
  const Table& measured(const Arguments& more) const {
    static std::map<Arguments, Table> tables;
    Table& table = tables[more];
    if (table.is_null()) {
      Arguments arguments = {"--dataset", data_.string(), "--format",
                             "json",      "--in-process", "--jobs",
                             "1",         "--thin",       "300"};
      arguments.insert(arguments.end(), more.begin(), more.end());
      const Result result = evaluate(arguments);
      EXPECT_EQ(result.exit_code, 0) << result.err;
      table = result.json();
    }
    return table;
  }
  const Table& whole() const { return measured({"--methods", "robust,median"}); }

  static double mean_age(const Table& table, const std::string& method) {
    double sum = 0;
    int count = 0;
    for (const auto& row : table)
      if (row.at("method") == method) sum += row.at("AGE").get<double>(), ++count;
    EXPECT_GT(count, 0);
    return sum / count;
  }

  fs::path data_;
};

TEST_F(RobustSequences, MeanOfGreyErrors) {
  EXPECT_LE(mean_age(whole(), "robust"), 2.0);
  // Measured 1.64 and 8.8.
  EXPECT_LE(mean_age(whole(), "robust"), 1.7);
  EXPECT_GT(mean_age(whole(), "median"), 8);
}

TEST_F(RobustSequences, NoneIsWorseThanTheMedian) {
  for (const auto& row : whole()) {
    if (row.at("method") != "robust") continue;
    const std::string sequence = row.at("sequence");
    const double median = row_of(whole(), sequence, "median").at("AGE").get<double>();
    EXPECT_LE(row.at("AGE").get<double>(), std::max(median, 2.0)) << sequence;
  }
}

TEST_F(RobustSequences, OrderAndRateMatterLittle) {
  const double age = mean_age(whole(), "robust");
  EXPECT_LE(mean_age(measured({"--methods", "robust", "--reverse"}), "robust"), 1.15 * age);
  EXPECT_LE(mean_age(measured({"--methods", "robust", "--every", "2"}), "robust"), 1.15 * age);
}

TEST_F(RobustSequences, MasksAreAtLeastThoseOfMog2AndKnn) {
  const char* sequences[] = {"SBI/HallAndMonitor", "SBI/CaVignal", "CDnet/office"};
  const Table& others =
      measured({"--methods", "mog2,knn", "--sequences", "HallAndMonitor,CaVignal,office"});
  for (const char* sequence : sequences) {
    const double f = row_of(whole(), sequence, "robust").at("F").get<double>();
    for (const char* method : {"mog2", "knn"}) {
      const double other = row_of(others, sequence, method).at("F").get<double>();
      std::printf("%s: F %.3f, %s %.3f\n", sequence, f, method, other);
      EXPECT_GE(f, other) << sequence << " " << method;
    }
  }
}

}  // namespace
}  // namespace qdmd::test
