// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs qdmd-evaluate as a process, on data sets that are painted for a test.
#pragma once

#include <glib.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace qdmd::test {

namespace fs = std::filesystem;

// ---- Processes ----

using Arguments = std::vector<std::string>;

inline Arguments command(const Arguments& arguments) {
  const char* program = std::getenv("QDMD_EVALUATE");
  Arguments all{program ? program : "QDMD_EVALUATE is not set"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return all;
}

inline std::vector<gchar*> argv_of(Arguments& arguments) {
  std::vector<gchar*> argv;
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  return argv;
}

struct Result {
  int exit_code = -1;  // -1: did not end by itself
  std::string out, err;

  nlohmann::json json() const {
    auto parsed = nlohmann::json::parse(out, nullptr, false);
    EXPECT_FALSE(parsed.is_discarded()) << out << err;
    return parsed;
  }
  bool says(const std::string& text) const { return err.find(text) != std::string::npos; }
};

inline Result evaluate(const Arguments& arguments) {
  Arguments all = command(arguments);
  std::vector<gchar*> argv = argv_of(all);
  gchar *out = nullptr, *err = nullptr;
  gint status = 0;
  GError* error = nullptr;
  Result result;
  if (!g_spawn_sync(nullptr, argv.data(), nullptr, G_SPAWN_DEFAULT, nullptr, nullptr, &out, &err,
                    &status, &error)) {
    ADD_FAILURE() << error->message;
    g_clear_error(&error);
    return result;
  }
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  result.out = out;
  result.err = err;
  g_free(out);
  g_free(err);
  return result;
}

// Starts it without waiting; its output goes nowhere.
inline GPid start(const Arguments& arguments) {
  Arguments all = command(arguments);
  std::vector<gchar*> argv = argv_of(all);
  GPid process = 0;
  GError* error = nullptr;
  const auto flags = static_cast<GSpawnFlags>(
      G_SPAWN_DO_NOT_REAP_CHILD | G_SPAWN_STDOUT_TO_DEV_NULL | G_SPAWN_STDERR_TO_DEV_NULL);
  if (!g_spawn_async(nullptr, argv.data(), nullptr, flags, nullptr, nullptr, &process, &error)) {
    ADD_FAILURE() << error->message;
    g_clear_error(&error);
  }
  return process;
}

// As kill -9. True if the process was still running.
inline bool kill_process(GPid process) {
  int status = 0;
  kill(process, SIGKILL);
  EXPECT_EQ(waitpid(process, &status, 0), process);
  g_spawn_close_pid(process);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
}

// ---- Data sets ----

// A folder that goes with the test.
class Folder {
 public:
  Folder() {
    gchar* made = g_dir_make_tmp("qdmd-evaluate-XXXXXX", nullptr);
    path_ = made ? made : "";
    g_free(made);
  }
  ~Folder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  fs::path operator/(const std::string& part) const { return path_ / part; }
  std::string string() const { return path_.string(); }

 private:
  fs::path path_;
};

inline constexpr int kWidth = 48, kHeight = 36, kSquare = 10;

// A textured picture that stays.
inline cv::Mat still_picture(int width = kWidth, int height = kHeight) {
  cv::Mat picture(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      picture.at<cv::Vec3b>(y, x) = {static_cast<uint8_t>(50 + (5 * x + 3 * y) % 60),
                                     static_cast<uint8_t>(80 + (2 * x + 7 * y) % 50),
                                     static_cast<uint8_t>(60 + (9 * x + y) % 70)};
  return picture;
}

inline cv::Rect square_at(int t) {
  return {(3 * t) % (kWidth - kSquare), (2 * t) % (kHeight - kSquare), kSquare, kSquare};
}

// The picture with some noise and a bright square that moves.
inline cv::Mat frame_at(int t, int width = kWidth, int height = kHeight) {
  cv::Mat picture = still_picture(width, height), noise(height, width, CV_8UC3);
  cv::RNG rng(static_cast<uint64_t>(t) + 1);
  rng.fill(noise, cv::RNG::UNIFORM, 0, 7);
  picture += noise;
  picture -= cv::Scalar::all(3);
  picture(square_at(t) & cv::Rect(0, 0, width, height)) = cv::Scalar(230, 30, 240);
  return picture;
}

// CDnet's labels of frame t: the square, unknown left of it, shadow right of it, and a row that is
// outside the region of interest.
inline cv::Mat labels_at(int t) {
  cv::Mat labels(kHeight, kWidth, CV_8UC1, cv::Scalar(0));
  const cv::Rect square = square_at(t), all(0, 0, kWidth, kHeight);
  labels((square - cv::Point(2, 0)) & all) = 170;
  labels((square + cv::Point(2, 0)) & all) = 50;
  labels(square) = 255;
  labels.row(0) = 85;
  return labels;
}

inline void write(const fs::path& path, const cv::Mat& picture) {
  fs::create_directories(path.parent_path());
  ASSERT_TRUE(cv::imwrite(path.string(), picture)) << path;
}

inline void write_text(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

inline std::string numbered(const char* before, int number) {
  char name[32];
  std::snprintf(name, sizeof name, "%s%06d.png", before, number);
  return name;
}

inline void write_frames(const fs::path& sequence, int count, int first = 0) {
  for (int t = first; t < first + count; ++t)
    write(sequence / "input" / numbered("in", t), frame_at(t));
}

// As in SBI, with masks of every other frame if `masks`.
inline void write_sequence(const fs::path& sequence, int count, bool masks = false) {
  write_frames(sequence, count);
  write(sequence / "gt" / ("GT_" + sequence.filename().string() + ".png"), still_picture());
  for (int t = 0; masks && t < count; t += 2)
    write(sequence / "gt" / "masks" / numbered("gt", t), labels_at(t));
}

// ---- Tables ----

inline const std::vector<std::string> kColumns = {
    "sequence", "method",    "AGE",    "pEPs", "pCEPs",  "MSSSIM", "PSNR",
    "CQM",      "precision", "recall", "F",    "frames", "seconds"};

inline nlohmann::json row_of(const nlohmann::json& table, const std::string& sequence,
                             const std::string& method) {
  for (const auto& row : table)
    if (row.at("sequence") == sequence && row.at("method") == method) return row;
  ADD_FAILURE() << "no row " << sequence << " " << method << " in " << table;
  return {};
}

// A table but for the times, which no two runs share.
inline nlohmann::json without_seconds(nlohmann::json table) {
  for (auto& row : table) row.erase("seconds");
  return table;
}

// Mean difference of BT.601 luma in 16..235, from the formula in floating point.
inline double grey_error(const cv::Mat& a, const cv::Mat& b) {
  const auto luma = [](const cv::Vec3b& bgr) {
    return std::floor(16 + (65.481 * bgr[2] + 128.553 * bgr[1] + 24.966 * bgr[0]) / 255 + 0.5);
  };
  double sum = 0;
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x)
      sum += std::abs(luma(a.at<cv::Vec3b>(y, x)) - luma(b.at<cv::Vec3b>(y, x)));
  return sum / static_cast<double>(a.total());
}

}  // namespace qdmd::test
