// SPDX-License-Identifier: LGPL-2.1-or-later
// qdmd-evaluate from outside: tables, layouts, pictures, masks, and the element beside the core.
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "core/engine/engine.h"
#include "tests/evaluation/evaluate_util.h"

namespace qdmd::test {
namespace {

const Arguments kAllMethods = {"qdmd", "dmd", "robust", "median", "mean", "mog2", "knn"};

// ---- Tables ----

TEST(Table, HasTheColumnsAndNullsWhereThereIsNothing) {
  const Folder data;
  write_sequence(data / "with", 12, true);
  write_sequence(data / "without", 12);
  const Result result = evaluate({"--dataset", data.string(), "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto table = nlohmann::ordered_json::parse(result.out);
  // Every method of the element, and at least these.
  std::set<std::string> methods;
  for (const auto& row : table) methods.insert(row.at("method").get<std::string>());
  for (const auto& method : kAllMethods) EXPECT_TRUE(methods.contains(method)) << method;
  ASSERT_EQ(table.size(), 2 * methods.size());
  for (const auto& row : table) {
    std::vector<std::string> columns;
    for (const auto& [name, value] : row.items()) columns.push_back(name);
    EXPECT_EQ(columns, kColumns);
    for (const char* name : {"AGE", "pEPs", "pCEPs", "MSSSIM", "PSNR", "CQM", "frames", "seconds"})
      EXPECT_TRUE(row.at(name).is_number()) << name << " in " << row;
    EXPECT_EQ(row.at("frames"), 12);
    const std::string method = row.at("method");
    const bool masks = row.at("sequence") == "with" && method != "mean" && method != "median";
    for (const char* name : {"precision", "recall", "F"})
      EXPECT_EQ(row.at(name).is_number(), masks) << name << " in " << row;
  }
}

TEST(Table, CsvAndTextSayTheSameAsJson) {
  const Folder data, out;
  write_sequence(data / "a,b", 8);
  write_sequence(data / "c", 9, true);
  // The rows of one run, three times: finished results are kept.
  const Arguments same = {"--dataset", data.string(), "--methods", "mean,mog2",
                          "--resume",  out.string(),  "--format"};
  const auto with = [&](const char* format) {
    Arguments arguments = same;
    arguments.push_back(format);
    return evaluate(arguments);
  };
  const auto table = with("json").json();
  ASSERT_EQ(table.size(), 4u);
  std::istringstream csv(with("csv").out), text(with("text").out);
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line,
            "sequence,method,AGE,pEPs,pCEPs,MSSSIM,PSNR,CQM,precision,recall,F,frames,seconds");
  std::getline(text, line);
  for (const auto& row : table) {
    std::getline(csv, line);
    std::string expected = row.at("sequence") == "a,b" ? "\"a,b\"" : "c";
    std::vector<std::string> words = {row.at("sequence"), row.at("method")};
    expected += "," + row.at("method").get<std::string>();
    for (size_t i = 2; i < kColumns.size(); ++i) {
      const auto& value = row.at(kColumns[i]);
      char number[64] = "";
      const int decimals = kColumns[i] == "frames" ? 0 : kColumns[i] == "seconds" ? 3 : 4;
      if (!value.is_null())
        std::snprintf(number, sizeof number, "%.*f", decimals, value.get<double>());
      expected += std::string(",") + number;
      words.push_back(value.is_null() ? "-" : number);
    }
    EXPECT_EQ(line, expected);
    std::getline(text, line);
    std::istringstream in_line(line);
    const std::vector<std::string> found{std::istream_iterator<std::string>(in_line), {}};
    EXPECT_EQ(found, words);
  }
  EXPECT_FALSE(std::getline(csv, line));
}

// ---- Layouts ----

TEST(Layouts, AllAreRecognized) {
  const Folder data;
  write_sequence(data / "sbi", 6);
  write_frames(data / "derived", 6);
  write(data / "derived/gt/DERIVED_x.png", still_picture());
  write_frames(data / "basic/sbmnet", 6);
  write(data / "basic/sbmnet/GT/anything.png", still_picture());
  write_frames(data / "cdnet", 6, 1);
  for (int t = 1; t <= 6; ++t) write(data / "cdnet/groundtruth" / numbered("gt", t), labels_at(t));
  fs::create_directories(data / "other");
  const Result result =
      evaluate({"--dataset", data.string(), "--methods", "qdmd", "--format", "json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto table = result.json();
  ASSERT_EQ(table.size(), 4u) << table;
  for (const char* name : {"sbi", "derived", "basic/sbmnet"})
    EXPECT_TRUE(row_of(table, name, "qdmd").at("AGE").is_number());
  const auto cdnet = row_of(table, "cdnet", "qdmd");
  EXPECT_TRUE(cdnet.at("AGE").is_null());
  EXPECT_TRUE(cdnet.at("F").is_number());
}

TEST(Layouts, OneSequenceIsADataSet) {
  const Folder data;
  write_sequence(data / "street", 6);
  const Arguments rest = {"--methods", "median", "--format", "json"};
  Arguments one = {"--dataset", (data / "street").string()}, all = {"--dataset", data.string()};
  one.insert(one.end(), rest.begin(), rest.end());
  all.insert(all.end(), rest.begin(), rest.end());
  const Result result = evaluate(one);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(without_seconds(result.json()), without_seconds(evaluate(all).json()));
}

TEST(Layouts, TheOfficialTruthGoesBeforeTheDerivedOne) {
  const Folder data;
  write_sequence(data / "s", 5);
  write(data / "s/gt/DERIVED_s.png", cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar::all(0)));
  const auto table =
      evaluate({"--dataset", data.string(), "--methods", "median", "--format", "json"}).json();
  EXPECT_LT(row_of(table, "s", "median").at("AGE"), 5);
}

// Beside input/ in CDnet's own folders, in gt/ in ours.
TEST(Layouts, TheRegionOfInterestIsNoTruthAndMasksFollowIt) {
  constexpr int kFrames = 8;
  const Folder data;
  const cv::Mat white(kHeight, kWidth, CV_8UC1, cv::Scalar(255));
  cv::Mat region = white.clone();
  region.colRange(0, kWidth / 2) = 0;
  for (const std::string name : {"cdnet", "ours", "marked"}) {
    write_frames(data / name, kFrames);
    const fs::path masks = name == "ours" ? data / "ours/gt/masks" : data / name / "groundtruth";
    for (int t = 0; t < kFrames; ++t) {
      cv::Mat labels = labels_at(t);
      if (name == "marked") labels.setTo(85, region == 0);
      if (name != "marked" || (t >= 3 && t <= 5)) write(masks / numbered("gt", t), labels);
    }
  }
  write(data / "cdnet/ROI.bmp", region);
  write_text(data / "cdnet/temporalROI.txt", "3 5\n");
  write(data / "ours/gt/ROI.bmp", region);
  write_text(data / "ours/gt/temporalROI.txt", "3 5");
  const auto run = [&data] {
    const Result result =
        evaluate({"--dataset", data.string(), "--methods", "qdmd", "--format", "json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.json();
  };
  const auto table = run();
  for (const char* name : {"cdnet", "ours"}) {
    const auto row = row_of(table, name, "qdmd"), marked = row_of(table, "marked", "qdmd");
    EXPECT_TRUE(row.at("AGE").is_null()) << row;
    for (const char* column : {"precision", "recall", "F"})
      EXPECT_EQ(row.at(column), marked.at(column)) << name << " " << column;
  }
  write(data / "cdnet/ROI.bmp", white);
  EXPECT_NE(row_of(run(), "cdnet", "qdmd").at("F"), row_of(table, "cdnet", "qdmd").at("F"));
}

// ---- Frames and pictures ----

TEST(Selection, TakesTheFramesThatItSays) {
  const Folder data;
  write_sequence(data / "all", 30);
  for (int t : {4, 7, 10, 13, 16}) write(data / "chosen/input" / numbered("in", t), frame_at(t));
  write(data / "chosen/gt/GT_x.png", still_picture());
  const Arguments methods = {"--methods", "qdmd,median", "--format", "json"};
  Arguments some = {
      "--dataset", (data / "all").string(), "--start", "4", "--every", "3", "--frames", "5"};
  Arguments chosen = {"--dataset", (data / "chosen").string()};
  some.insert(some.end(), methods.begin(), methods.end());
  chosen.insert(chosen.end(), methods.begin(), methods.end());
  auto a = without_seconds(evaluate(some).json()), b = without_seconds(evaluate(chosen).json());
  ASSERT_EQ(a.size(), 2u);
  for (auto* table : {&a, &b})
    for (auto& row : *table) row.erase("sequence");
  EXPECT_EQ(a, b);
  EXPECT_EQ(a[0].at("frames"), 5);

  const Result none = evaluate({"--dataset", (data / "all").string(), "--start", "30"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_TRUE(none.says("all: no frames are left")) << none.err;
}

TEST(Selection, ThinsEvenlyAndTurnsRound) {
  const Folder data;
  write_sequence(data / "all", 30);
  // Kept are those at index i * 25 / 7 of frames 3 .. 27.
  const std::vector<int> kept = {3, 6, 10, 13, 17, 20, 24};
  for (size_t i = 0; i < kept.size(); ++i) {
    write(data / "forwards/input" / numbered("in", static_cast<int>(i)), frame_at(kept[i]));
    write(data / "backwards/input" / numbered("in", static_cast<int>(i)),
          frame_at(kept[kept.size() - 1 - i]));
  }
  for (const char* name : {"forwards", "backwards"})
    write(data / name / "gt/GT_x.png", still_picture());
  // The paper's amplitude knows which frame is the first.
  const auto table_of = [&](const char* sequence, Arguments more) {
    Arguments arguments = {
        "--dataset", (data / sequence).string(), "--methods", "qdmd,mog2", "--format", "json",
        "--set",     "amplitude=first-frame"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto table = without_seconds(evaluate(arguments).json());
    for (auto& row : table) row.erase("sequence");
    return table;
  };
  const Arguments thin = {"--start", "3", "--frames", "25", "--thin", "7"};
  Arguments turned = thin;
  turned.emplace_back("--reverse");
  const auto forwards = table_of("all", thin), backwards = table_of("all", turned);
  EXPECT_EQ(forwards, table_of("forwards", {}));
  EXPECT_EQ(backwards, table_of("backwards", {}));
  EXPECT_EQ(backwards, table_of("forwards", {"--reverse"}));
  EXPECT_NE(forwards, backwards);
  EXPECT_EQ(forwards[0].at("frames"), 7);
  // Nothing to thin.
  EXPECT_EQ(table_of("all", {"--thin", "30"}), table_of("all", {}));
  EXPECT_EQ(table_of("all", {"--thin", "300"}), table_of("all", {"--thin", "0"}));
}

// L(t) by the engine itself.
std::vector<cv::Mat> outputs(const std::vector<cv::Mat>& frames, Output output,
                             const EngineOptions& options) {
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  const auto view = [](const cv::Mat& bgr) {
    MutableImageView v;
    for (int c = 0; c < 3; ++c) v.channel[c] = bgr.data + 2 - c;
    v.width = bgr.cols;
    v.height = bgr.rows;
    v.pixel_stride = 3;
    v.row_stride = 3 * bgr.cols;
    return v;
  };
  std::vector<cv::Mat> all;
  const auto take = [&] {
    while (engine.next()) {
      all.emplace_back(kHeight, kWidth, CV_8UC3);
      engine.next()->pop(output, view(all.back()));
    }
  };
  for (const auto& frame : frames) {
    const MutableImageView v = view(frame);
    ImageView in;
    std::copy(v.channel, v.channel + 3, in.channel);
    in.width = v.width, in.height = v.height;
    in.pixel_stride = v.pixel_stride, in.row_stride = v.row_stride;
    EXPECT_TRUE(engine.push(in).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  return all;
}

std::vector<cv::Mat> frames_of(int count) {
  std::vector<cv::Mat> frames;
  for (int t = 0; t < count; ++t) frames.push_back(frame_at(t));
  return frames;
}

TEST(Pictures, AreTheBackgroundsAtTheirFrames) {
  constexpr int kFrames = 15;
  const Folder data, out;
  write_sequence(data / "s", kFrames);
  EngineOptions options;
  options.method = Method::qdmd;
  options.window_size = kFrames;
  const auto l = outputs(frames_of(kFrames), Output::background, options);
  for (const auto& [picture, t] : {std::pair{"first", 0}, {"middle", 7}, {"last", 14}}) {
    const Result result = evaluate({"--dataset", data.string(), "--methods", "qdmd", "--picture",
                                    picture, "--output-dir", out.string(), "--format", "json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const cv::Mat written = cv::imread((out / "s_qdmd.png").string());
    EXPECT_EQ(cv::norm(written, l[t], cv::NORM_INF), 0) << picture;
    // The table is about the picture that was written.
    EXPECT_NEAR(result.json()[0].at("AGE"), grey_error(written, still_picture()), 1e-9);
  }
  evaluate({"--dataset", data.string(), "--methods", "qdmd", "--picture", "median", "--output-dir",
            out.string()});
  const cv::Mat median = cv::imread((out / "s_qdmd.png").string());
  for (int y = 0; y < kHeight; ++y)
    for (int i = 0; i < 3 * kWidth; ++i) {
      std::vector<uint8_t> levels;
      for (const auto& picture : l) levels.push_back(picture.ptr(y)[i]);
      std::sort(levels.begin(), levels.end());
      ASSERT_EQ(median.ptr(y)[i], levels[kFrames / 2]) << i << ", " << y;
    }
}

TEST(Pictures, MeanAndMedianAreThatOfTheFrames) {
  for (int count : {4, 5}) {
    const Folder data, out;
    write_sequence(data / "s", count);
    const Result result = evaluate(
        {"--dataset", data.string(), "--methods", "mean,median", "--output-dir", out.string()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const cv::Mat mean = cv::imread((out / "s_mean.png").string());
    const cv::Mat median = cv::imread((out / "s_median.png").string());
    for (int y = 0; y < kHeight; ++y)
      for (int i = 0; i < 3 * kWidth; ++i) {
        std::vector<double> levels;
        double sum = 0;
        for (const auto& frame : frames_of(count)) {
          levels.push_back(frame.ptr(y)[i]);
          sum += levels.back();
        }
        std::sort(levels.begin(), levels.end());
        const size_t half = levels.size() / 2;
        const double middle = count % 2 ? levels[half] : (levels[half - 1] + levels[half]) / 2;
        ASSERT_NEAR(mean.ptr(y)[i], sum / count, 0.5);
        ASSERT_EQ(median.ptr(y)[i], std::floor(middle + 0.5));
      }
    EXPECT_FALSE(cv::imread((out / "s_sheet.png").string()).empty());
  }
}

// ---- Masks ----

TEST(Masks, AreCountedOverTheFramesThatHaveThem) {
  constexpr int kFrames = 16;
  const Folder data;
  write_sequence(data / "s", kFrames, true);  // masks of even frames
  const auto row = evaluate({"--dataset", data.string(), "--methods", "qdmd", "--start", "1",
                             "--format", "json"})
                       .json()
                       .at(0);
  auto frames = frames_of(kFrames);
  frames.erase(frames.begin());
  EngineOptions options;
  options.method = Method::qdmd;
  options.window_size = kFrames - 1;
  const auto masks = outputs(frames, Output::mask, options);
  double hits = 0, called = 0, foreground = 0;
  for (int t = 2; t < kFrames; t += 2) {
    const cv::Mat labels = labels_at(t);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const int label = labels.at<uint8_t>(y, x);
        if (label == 85 || label == 170) continue;
        const bool is_called = masks[t - 1].at<cv::Vec3b>(y, x)[0] > 0;
        called += is_called;
        foreground += label == 255;
        hits += is_called && label == 255;
      }
  }
  ASSERT_GT(hits, 0);
  const double precision = hits / called, recall = hits / foreground;
  EXPECT_DOUBLE_EQ(row.at("precision"), precision);
  EXPECT_DOUBLE_EQ(row.at("recall"), recall);
  EXPECT_DOUBLE_EQ(row.at("F"), 2 * precision * recall / (precision + recall));
}

// ---- The element and the core ----

TEST(Element, GivesThePicturesOfTheCore) {
  const Folder data;
  write_sequence(data / "a", 23, true);
  write_sequence(data / "b", 14);
  const std::vector<Arguments> settings = {
      {},
      {"--set", "amplitude=first-frame", "--set", "solver=gram-extended"},
      {"--set", "rank=3", "--set", "omega-threshold=0.2"},
      // Several windows and a remainder.
      {"--set", "window-size=9", "--set", "foreground-threshold=30", "--picture", "last"},
      {"--set", "n-threads=2", "--set", "max-memory=100000000", "--picture", "median"}};
  for (const auto& setting : settings) {
    const Folder element, core;
    Arguments arguments = {"--dataset", data.string(), "--methods", "qdmd,dmd", "--format", "json"};
    arguments.insert(arguments.end(), setting.begin(), setting.end());
    Arguments in_process = arguments;
    arguments.insert(arguments.end(), {"--output-dir", element.string()});
    in_process.insert(in_process.end(), {"--output-dir", core.string(), "--in-process"});
    const Result a = evaluate(arguments), b = evaluate(in_process);
    ASSERT_EQ(a.exit_code, 0) << a.err;
    ASSERT_EQ(b.exit_code, 0) << b.err;
    EXPECT_EQ(a.json().size(), 4u);
    EXPECT_EQ(without_seconds(a.json()), without_seconds(b.json()));
    for (const char* name : {"a_qdmd.png", "a_dmd.png", "b_qdmd.png", "b_dmd.png"})
      EXPECT_EQ(cv::norm(cv::imread((element / name).string()), cv::imread((core / name).string()),
                         cv::NORM_INF),
                0)
          << name;
  }
}

TEST(Element, PropertiesChangeThePicture) {
  const Folder data, out;
  write_sequence(data / "s", 20);
  std::set<double> errors;
  for (const char* setting : {"rank=0", "rank=1", "window-size=5"})
    errors.insert(evaluate({"--dataset", data.string(), "--methods", "qdmd", "--set", setting,
                            "--resume", out.string(), "--format", "json"})
                      .json()
                      .at(0)
                      .at("AGE")
                      .get<double>());
  EXPECT_EQ(errors.size(), 3u);
}

// Numbers in names count by their value, with and without leading zeros.
TEST(Evaluate, TenComesAfterTwo) {
  const Folder data;
  for (int t = 1; t <= 12; ++t) {
    write(data / "plain/input" / (std::to_string(t) + ".png"), frame_at(t));
    char name[16];
    std::snprintf(name, sizeof name, "%03d.png", t);
    write(data / "padded/input" / name, frame_at(t));
  }
  for (const char* sequence : {"plain", "padded"})
    write(data / sequence / "gt/GT_x.png", still_picture());
  const Result result = evaluate(
      {"--dataset", data.string(), "--methods", "mean,mog2", "--frames", "4", "--format", "json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto table = result.json();
  for (const char* method : {"mean", "mog2"})
    EXPECT_EQ(row_of(table, "plain", method).at("AGE"), row_of(table, "padded", method).at("AGE"));
}

}  // namespace
}  // namespace qdmd::test
