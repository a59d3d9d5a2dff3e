// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/outputs.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "examples/archive/files.h"
#include "examples/archive/job_folder.h"
#include "examples/archive/video_writer.h"

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

std::string folder_of(const std::string& path) { return path + ".parts"; }

const char* option_of(Output output) {
  switch (output) {
    case Output::background:
      return "--background";
    case Output::foreground:
      return "--foreground";
    case Output::mask:
      return "--mask";
    case Output::cutout:
      break;
  }
  return "--cutout";
}

bool is_one_name(const fs::path& a, const fs::path& b) {
  return fs::absolute(a).lexically_normal() == fs::absolute(b).lexically_normal();
}

bool is_same(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return fs::equivalent(a, b, error);
}

// True for picture_of(path, window) with a window above 0.
bool is_later_picture(const fs::path& name, const fs::path& path) {
  const std::string stem = name.stem().string(), first = path.stem().string() + "-";
  if (name.extension() != path.extension() || !stem.starts_with(first)) return false;
  const std::string number = stem.substr(first.size());
  return number.find_first_not_of("0123456789") == std::string::npos && !number.empty() &&
         number.front() != '0' && number != "1";
}

fs::path beside(const fs::path& path) {
  return fs::absolute(path).lexically_normal().parent_path();
}

// All that a job writes or removes, as far as it is there.
std::vector<fs::path> files_of_job(const std::vector<Wanted>& wanted, const std::string& report) {
  std::vector<fs::path> all;
  if (!report.empty() && report != "-") all.emplace_back(report);
  for (const Wanted& one : wanted) {
    all.emplace_back(one.path);
    all.emplace_back(temporary_of(one.path));
    std::error_code error;
    for (fs::directory_iterator entry(beside(one.path), error), end;
         one.is_picture() && !error && entry != end; entry.increment(error))
      if (is_later_picture(entry->path().filename(), one.path)) all.push_back(entry->path());
  }
  return all;
}

// Throws std::runtime_error: machines may have other files.
void check_not_read(const std::vector<Wanted>& wanted, const std::string& report,
                    const std::vector<std::string>& recordings) {
  for (const fs::path& path : files_of_job(wanted, report))
    for (const fs::path recording : recordings) {
      const bool is_picture =
          path.extension() == ".png" || path.extension() == ".jpg" || path.extension() == ".jpeg";
      std::error_code error;
      if (is_same(recording, path) ||
          (fs::is_directory(recording, error) && is_same(recording, beside(path)) &&
           (is_picture || fs::exists(path, error))))
        throw std::runtime_error(path.string() +
                                 " would be among what is read: give the results another folder");
    }
  for (const Wanted& one : wanted)
    for (const fs::path recording : recordings)
      for (const std::string& folder : {folder_of(one.path), JobFolder(one.path).path()})
        if (is_same(folder, beside(recording)))
          throw std::runtime_error(recording.string() + " is in " + folder +
                                   ", which is removed: move it first");
}

}  // namespace

bool Wanted::is_picture() const { return fs::path(path).extension() == ".png"; }

void check_wanted(const std::vector<Wanted>& wanted, const std::vector<std::string>& recordings,
                  const std::string& report) {
  if (wanted.empty())
    throw std::invalid_argument(
        "nothing is to be written: give --background, --mask, --foreground or --cutout");
  for (const Wanted& one : wanted) {
    const fs::path path(one.path);
    if (path.extension() != ".mkv" && one.output != Output::background)
      throw std::invalid_argument(std::string(option_of(one.output)) +
                                  " is a video: give it a name that ends in .mkv");
    if (!one.is_picture() && path.extension() != ".mkv")
      throw std::invalid_argument(one.path +
                                  " ends in neither .mkv (a video) nor .png (a picture)");
    for (const Wanted& other : wanted)
      if (&other != &one && is_one_name(other.path, one.path))
        throw std::invalid_argument(one.path + " is named twice");
    if (!report.empty() && is_one_name(report, one.path))
      throw std::invalid_argument(report + " is named twice");
  }
  check_not_read(wanted, report, recordings);
}

std::string part_of(const std::string& path, size_t stretch) {
  char name[32];
  std::snprintf(name, sizeof name, "%08zu.mkv", stretch + 1);
  return (fs::path(folder_of(path)) / name).string();
}

std::string picture_of(const std::string& path, int64_t window) {
  if (window == 0) return path;
  const fs::path whole(path);
  return (whole.parent_path() /
          (whole.stem().string() + "-" + std::to_string(window + 1) + whole.extension().string()))
      .string();
}

void begin_parts(const std::vector<Wanted>& wanted) {
  for (const Wanted& one : wanted) {
    const fs::path beside = fs::absolute(one.path).parent_path();
    if (!fs::is_directory(beside))
      throw std::runtime_error(beside.string() + " is no folder: make it first");
    if (one.is_picture()) continue;
    fs::remove_all(folder_of(one.path));
    fs::create_directory(folder_of(one.path));
  }
}

void check_parts(const std::vector<Wanted>& wanted, const std::vector<size_t>& stretches) {
  for (const Wanted& one : wanted)
    for (size_t stretch : stretches)
      if (!one.is_picture() && !fs::exists(part_of(one.path, stretch)))
        throw std::runtime_error(part_of(one.path, stretch) +
                                 " is gone: begin anew, without --resume");
}

void join_parts(const std::vector<Wanted>& wanted, const std::vector<size_t>& stretches) {
  for (const Wanted& one : wanted) {
    if (one.is_picture()) continue;
    std::vector<std::string> parts;
    for (size_t stretch : stretches) parts.push_back(part_of(one.path, stretch));
    join_videos(parts, temporary_of(one.path));
    give_name(one.path);
  }
}

void remove_parts(const std::vector<Wanted>& wanted) {
  for (const Wanted& one : wanted)
    if (!one.is_picture()) fs::remove_all(folder_of(one.path));
}

}  // namespace qdmd::archive
