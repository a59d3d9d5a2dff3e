#include "examples/archive/outputs.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "examples/archive/files.h"
#include "examples/archive/picture.h"

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

std::string folder_of(const std::string& path) { return path + ".parts"; }

std::string picture_of(const std::string& path, int64_t window) {
  if (window == 0) return path;
  const fs::path whole(path);
  return (whole.parent_path() /
          (whole.stem().string() + "-" + std::to_string(window + 1) + whole.extension().string()))
      .string();
}

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
    for (const std::string& path : {one.path, progress_of(one.path)}) {
      all.emplace_back(path);
      all.emplace_back(temporary_of(path));
    }
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
      if (is_same(folder_of(one.path), beside(recording)))
        throw std::runtime_error(recording.string() + " is in the folder of " + one.path +
                                 "'s parts, which are removed: move it first");
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

Outputs::Outputs(std::vector<Wanted> wanted, const GstVideoInfo& picture, double rate,
                 std::string encoder)
    : wanted_(std::move(wanted)),
      picture_(picture),
      mask_(mask_info(picture)),
      rate_(rate),
      encoder_(std::move(encoder)) {}

std::string Outputs::part_of(size_t which, int64_t window) const {
  char name[32];
  std::snprintf(name, sizeof name, "%08lld.mkv", static_cast<long long>(window + 1));
  return (fs::path(folder_of(wanted_[which].path)) / name).string();
}

Outputs::Open Outputs::open(size_t which, const std::string& path,
                            const std::string& encoder) const {
  const GstVideoInfo& info = wanted_[which].output == Output::mask ? mask_ : picture_;
  return {path, std::make_unique<VideoWriter>(temporary_of(path), info, rate_, encoder)};
}

void Outputs::begin_after(int64_t windows) {
  for (size_t which = 0; which < wanted_.size(); ++which) {
    const fs::path beside = fs::absolute(wanted_[which].path).parent_path();
    if (!fs::is_directory(beside))
      throw std::runtime_error(beside.string() + " is no folder: make it first");
    if (wanted_[which].is_picture()) {
      fs::remove(temporary_of(picture_of(wanted_[which].path, windows)));
      continue;
    }
    const fs::path folder = folder_of(wanted_[which].path);
    fs::create_directories(folder);
    std::vector<fs::path> known;
    for (int64_t window = 0; window < windows; ++window) known.push_back(part_of(which, window));
    std::vector<fs::path> unknown;
    for (const auto& entry : fs::directory_iterator(folder))
      if (std::find(known.begin(), known.end(), entry.path()) == known.end())
        unknown.push_back(entry.path());
    for (const fs::path& path : unknown) fs::remove(path);
    for (const fs::path& path : known)
      if (!fs::exists(path))
        throw std::runtime_error(path.string() + " is gone: begin anew, without --resume");
  }
}

void Outputs::write(size_t which, int64_t window, std::span<const uint8_t> frame,
                    GstClockTime time) {
  auto file = files_.find(which);
  if (file == files_.end())
    file = files_.emplace(which, open(which, part_of(which, window), encoder_)).first;
  file->second.writer->write(frame, time);
}

void Outputs::write_picture(size_t which, int64_t window, std::span<const uint8_t> frame) {
  wait();
  Open file = open(which, picture_of(wanted_[which].path, window), kPicture);
  file.writer->write(frame, 0);
  files_.emplace(which, std::move(file));
}

void Outputs::end_window(std::function<void()> after) {
  wait();
  ending_ = std::async(std::launch::async,
                       [files = std::exchange(files_, {}), after = std::move(after)]() mutable {
                         for (auto& [which, file] : files) {
                           file.writer->end();
                           file.writer.reset();
                           give_name(file.path);
                         }
                         after();
                       });
}

void Outputs::wait() {
  if (ending_.valid()) ending_.get();
}

void Outputs::join(int64_t windows) {
  for (size_t which = 0; which < wanted_.size(); ++which) {
    if (wanted_[which].is_picture()) continue;
    std::vector<std::string> parts;
    for (int64_t window = 0; window < windows; ++window) parts.push_back(part_of(which, window));
    join_videos(parts, temporary_of(wanted_[which].path));
    give_name(wanted_[which].path);
  }
}

void Outputs::remove_parts() {
  for (const Wanted& one : wanted_)
    if (!one.is_picture()) fs::remove_all(folder_of(one.path));
}

}  // namespace qdmd::archive
