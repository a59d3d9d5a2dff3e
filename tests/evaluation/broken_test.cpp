// SPDX-License-Identifier: LGPL-2.1-or-later
// qdmd-evaluate where something is wrong: broken folders, wrong options, and being killed.
#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <map>
#include <thread>

#include "tests/evaluation/evaluate_util.h"

namespace qdmd::test {
namespace {

// ---- Broken folders ----

TEST(Broken, IsNamedAndTheRestIsEvaluated) {
  const Folder data;
  write_sequence(data / "good", 6);
  write_sequence(data / "unreadable", 6);
  write_text(data / "unreadable/input/in000003.png", "no picture");
  write_sequence(data / "two-sizes", 6);
  write(data / "two-sizes/input/in000004.png", frame_at(4, kWidth + 1, kHeight));
  write_sequence(data / "single", 1);
  fs::create_directories(data / "empty/input");
  write(data / "empty/gt/GT_empty.png", still_picture());
  write(data / "no-input/gt/GT_x.png", still_picture());
  write_frames(data / "no-truth", 6);
  const Result result =
      evaluate({"--dataset", data.string(), "--methods", "qdmd,mean", "--format", "json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.says("unreadable: cannot read input/in000003.png")) << result.err;
  EXPECT_TRUE(
      result.says("two-sizes: two sizes: input/in000004.png has 49x36 pixels, "
                  "input/in000000.png has 48x36"))
      << result.err;
  EXPECT_TRUE(result.says("single: one frame only")) << result.err;
  EXPECT_TRUE(result.says("empty: no frames")) << result.err;
  EXPECT_TRUE(result.says("no-input: no frames")) << result.err;
  EXPECT_TRUE(result.says("no-truth: no truth")) << result.err;
  EXPECT_FALSE(result.says("good:")) << result.err;
  const auto table = result.json();
  ASSERT_EQ(table.size(), 6u) << table;
  EXPECT_LT(row_of(table, "good", "qdmd").at("AGE"), 40);
  // One frame is its own background.
  EXPECT_EQ(row_of(table, "single", "mean").at("AGE"), row_of(table, "single", "qdmd").at("AGE"));
  EXPECT_TRUE(row_of(table, "no-truth", "mean").at("AGE").is_null());
  EXPECT_EQ(row_of(table, "no-truth", "mean").at("frames"), 6);
}

TEST(Broken, PicturesThatAreCutOff) {
  const Folder data;
  for (const char* kind : {"png", "jpg"}) {
    for (int t = 0; t < 4; ++t)
      write(data / kind / "input" / ("in" + std::to_string(t) + "." + kind), frame_at(t));
    write(data / kind / "gt" / (std::string("GT_x.") + kind), still_picture());
  }
  const Arguments arguments = {"--dataset", data.string(), "--methods", "mean", "--format", "json"};
  const Result whole = evaluate(arguments);
  EXPECT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_EQ(whole.json().size(), 2u);
  for (const char* kind : {"png", "jpg"}) {
    const fs::path frame = data / kind / "input" / (std::string("in2.") + kind);
    fs::resize_file(frame, fs::file_size(frame) / 2);
  }
  const Result cut = evaluate(arguments);
  EXPECT_EQ(cut.exit_code, 1);
  EXPECT_TRUE(cut.says("png: cannot read input/in2.png")) << cut.err;
  EXPECT_TRUE(cut.says("jpg: cannot read input/in2.jpg")) << cut.err;
  EXPECT_EQ(cut.json().size(), 0u);
}

TEST(Broken, TruthAndMasksAreLeftOut) {
  const Folder data, out;
  write_sequence(data / "size", 6, true);
  write(data / "size/gt/GT_size.png", still_picture(kWidth, kHeight - 1));
  write_sequence(data / "text", 6);
  write_text(data / "text/gt/GT_text.png", "no picture");
  write_sequence(data / "labels", 6, true);
  write(data / "labels/gt/masks/gt000002.png", cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(100)));
  write_sequence(data / "numbers", 6);
  write(data / "numbers/gt/masks/gt000099.png", labels_at(0));
  write_sequence(data / "region", 6, true);
  write_text(data / "region/gt/temporalROI.txt", "from here");
  write(data / "region/gt/ROI.bmp", cv::Mat(kHeight + 1, kWidth, CV_8UC1, cv::Scalar(255)));
  // Also where finished results are there to be used.
  for (int run = 0; run < 2; ++run) {
    const Result result = evaluate({"--dataset", data.string(), "--methods", "qdmd", "--format",
                                    "json", "--resume", out.string()});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_TRUE(result.says("size: truth left out, two sizes: gt/GT_size.png has 48x35"))
        << result.err;
    EXPECT_TRUE(result.says("text: truth left out, cannot read gt/GT_text.png")) << result.err;
    EXPECT_TRUE(result.says("labels: masks left out, gt/masks/gt000002.png: label 100"))
        << result.err;
    EXPECT_TRUE(
        result.says("numbers: masks left out: none of them has the number of a frame that counts"))
        << result.err;
    EXPECT_TRUE(result.says("region: temporalROI.txt left out: it has not")) << result.err;
    EXPECT_TRUE(result.says("region: masks left out, two sizes: gt/ROI.bmp has 48x37"))
        << result.err;
    const auto table = result.json();
    EXPECT_TRUE(row_of(table, "numbers", "qdmd").at("F").is_null());
    EXPECT_TRUE(row_of(table, "region", "qdmd").at("F").is_null());
    EXPECT_TRUE(row_of(table, "size", "qdmd").at("AGE").is_null());
    EXPECT_TRUE(row_of(table, "size", "qdmd").at("F").is_number());
    EXPECT_TRUE(row_of(table, "text", "qdmd").at("AGE").is_null());
    EXPECT_TRUE(row_of(table, "labels", "qdmd").at("AGE").is_number());
    EXPECT_TRUE(row_of(table, "labels", "qdmd").at("F").is_null());
  }
}

TEST(Broken, WhatTheElementRefusesIsSaid) {
  const Folder data;
  write_sequence(data / "s", 6);
  for (const Arguments& how : {Arguments{}, Arguments{"--in-process"}}) {
    Arguments arguments = {"--dataset", data.string(),     "--methods", "qdmd,mean",
                           "--set",     "max-memory=1000", "--format",  "json"};
    arguments.insert(arguments.end(), how.begin(), how.end());
    const Result result = evaluate(arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_TRUE(result.says("s: qdmd: ")) << result.err;
    EXPECT_TRUE(result.says("max-memory")) << result.err;
    ASSERT_EQ(result.json().size(), 1u);
    EXPECT_EQ(result.json()[0].at("method"), "mean");
  }
}

TEST(Broken, ADiskThatIsFullIsSaid) {
  const Folder data, out;
  write_sequence(data / "s", 6);
  const std::string command = std::string(std::getenv("QDMD_EVALUATE")) + " --dataset " +
                              data.string() + " --methods mean >/dev/full 2>" +
                              (out / "err").string();
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  std::ifstream file(out / "err");
  const std::string said{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(said.find("cannot write the table"), std::string::npos) << said;
}

// ---- Wrong options ----

TEST(Options, WrongOnesEndWithTwoAndAReason) {
  const Folder data;
  write_sequence(data / "s", 4);
  const std::vector<std::pair<Arguments, std::string>> cases = {
      {{"--methods", "nothing"}, "there is no method 'nothing'; there are qdmd dmd"},
      {{"--set", "nothing=1"}, "no property 'nothing'"},
      {{"--set", "stats=1"}, "no property 'stats' that can be set"},
      {{"--set", "rank"}, "'rank' is not name=value"},
      {{"--set", "rank="}, "is not name=value"},
      {{"--set", "rank=-1"}, "'-1' is no value of the property 'rank'"},
      {{"--set", "window-size=1"}, "'1' is no value of the property 'window-size'"},
      {{"--set", "amplitude=loud"}, "'loud' is no value of the property 'amplitude'"},
      {{"--set", "method=dmd"}, "use --methods"},
      {{"--set", "output=mask"}, "set by the program itself"},
      {{"--in-process", "--set", "qos=true"}, "not with --in-process"},
      {{"--every", "0"}, "--every"},
      {{"--picture", "best"}, "--picture"},
      {{"--format", "xml"}, "--format"},
      {{"--jobs", "0"}, "--jobs"},
      {{"--frames", "-3"}, "--frames"},
      {{"extra"}, "extra"}};
  for (const auto& [wrong, reason] : cases) {
    Arguments arguments = {"--dataset", data.string()};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const Result result = evaluate(arguments);
    EXPECT_EQ(result.exit_code, 2) << wrong.back();
    EXPECT_TRUE(result.says(reason)) << result.err;
    EXPECT_EQ(result.out, "");
  }
  EXPECT_EQ(evaluate({"--dataset", (data / "nowhere").string()}).exit_code, 2);
  EXPECT_EQ(evaluate({}).exit_code, 2);
  const Result help = evaluate({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("Methods: qdmd dmd"), std::string::npos) << help.out;
}

TEST(Options, SequencesThatAreNotThereAreNamed) {
  const Folder data, none;
  write_sequence(data / "there", 4);
  const Result result = evaluate({"--dataset", data.string(), "--sequences", "there,missing",
                                  "--methods", "mean", "--format", "json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(result.says("missing: the data set has no such sequence")) << result.err;
  EXPECT_EQ(result.json().size(), 1u);
  const Result nothing = evaluate({"--dataset", none.string(), "--format", "json"});
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_TRUE(nothing.says("no sequences")) << nothing.err;
  EXPECT_EQ(nothing.json().size(), 0u);
}

// ---- Being killed ----

size_t files_in(const fs::path& folder, const std::string& extension) {
  size_t count = 0;
  if (!fs::exists(folder)) return 0;
  for (const auto& entry : fs::directory_iterator(folder))
    count += entry.path().extension() == extension;
  return count;
}

// True when it holds within a minute.
bool wait_until(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

TEST(Killed, GoesOnWithWhatWasNotFinished) {
  const Folder data, out, fresh;
  for (const char* name : {"a", "b", "c", "d"}) write_sequence(data / name, 10, true);
  // Nobody writes to this pipe: whoever reads the third sequence waits until killed.
  const fs::path stuck = data / "c/input/in000005.png";
  fs::remove(stuck);
  ASSERT_EQ(mkfifo(stuck.c_str(), 0600), 0);
  const Arguments to = {"--dataset",     data.string(), "--format", "json",        "--methods",
                        "qdmd,mean,knn", "--jobs",      "1",        "--output-dir"};
  Arguments arguments = to, all = to;
  arguments.push_back(out.string());
  all.push_back(fresh.string());
  const GPid process = start(arguments);
  ASSERT_TRUE(wait_until([&] { return files_in(out / "results", ".json") == 6; }));
  ASSERT_TRUE(kill_process(process));
  fs::remove(stuck);
  write(stuck, frame_at(5));

  std::map<std::pair<std::string, std::string>, nlohmann::json> finished;
  for (const auto& entry : fs::directory_iterator(out / "results")) {
    std::ifstream file(entry.path());
    const auto row = nlohmann::json::parse(file).at("row");
    finished[{row.at("sequence"), row.at("method")}] = row;
  }
  const Result again = evaluate(arguments);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const auto table = again.json();
  ASSERT_EQ(table.size(), 12u);
  EXPECT_EQ(finished.size(), 6u);
  // What was finished is not measured again: even its seconds are the same.
  for (const auto& [key, row] : finished) EXPECT_EQ(row_of(table, key.first, key.second), row);
  EXPECT_EQ(without_seconds(table), without_seconds(evaluate(all).json()));
  EXPECT_EQ(evaluate(arguments).out, again.out);
  EXPECT_EQ(files_in(out.string(), ".png"), 16u);
}

TEST(Killed, AtAnyTime) {
  const Folder data, out, fresh;
  for (const char* name : {"a", "b", "c"}) write_sequence(data / name, 12, true);
  const Arguments to = {"--dataset", data.string(), "--format", "json", "--output-dir"};
  Arguments arguments = to, all = to;
  arguments.push_back(out.string());
  all.push_back(fresh.string());
  // Each time a little later in its work.
  for (size_t finished : {0, 1, 2, 4, 7}) {
    const GPid process = start(arguments);
    EXPECT_TRUE(wait_until([&] { return files_in(out / "results", ".json") >= finished; }));
    kill_process(process);
  }
  const Result result = evaluate(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(without_seconds(result.json()), without_seconds(evaluate(all).json()));
}

TEST(Finished, ResultsAreNotUsedWhereAnythingChanged) {
  const Folder data, out;
  write_sequence(data / "s", 8);
  const auto run = [&](const Arguments& more) {
    Arguments arguments = {"--dataset", data.string(),  "--methods",
                           "mean",      "--output-dir", out.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return evaluate(arguments);
  };
  EXPECT_FALSE(run({}).says("done before"));
  EXPECT_TRUE(run({}).says("done before"));
  EXPECT_FALSE(run({"--frames", "5"}).says("done before"));
  // That wrote another picture under the same name.
  EXPECT_FALSE(run({}).says("done before"));
  EXPECT_FALSE(run({"--picture", "last"}).says("done before"));
  EXPECT_FALSE(run({"--set", "rank=1"}).says("done before"));
  fs::remove(out / "s_mean.png");
  EXPECT_FALSE(run({}).says("done before"));
  EXPECT_TRUE(run({}).says("done before"));
  write(data / "s/gt/GT_s.png", still_picture() + cv::Scalar::all(9));
  EXPECT_FALSE(run({}).says("done before"));
  EXPECT_TRUE(run({}).says("done before"));
  // A damaged result counts for nothing.
  for (const auto& entry : fs::directory_iterator(out / "results"))
    write_text(entry.path(), "{\"row\": {");
  EXPECT_FALSE(run({}).says("done before"));
}

}  // namespace
}  // namespace qdmd::test
