// Files that are whole or not there, and what a job has done so far.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace qdmd::archive {

// Where a file is written before it has its name.
std::string temporary_of(const std::string& path);
// The file at temporary_of(path), which nobody writes any more, is on the disk and then has its
// name. Throws std::runtime_error.
void give_name(const std::string& path);

// What is finished. It is written once the files of a window have their names, so that a job that
// is killed at any moment goes on after the last window that is whole.
struct Progress {
  std::string settings;  // what the files depend on; another job's are not gone on with
  int64_t windows = 0, frames = 0;
  bool ended = false;   // no frame is left; the videos of windows are to be joined
  bool joined = false;  // they are, and what they were made of may be gone
};

// Beside the first output.
std::string progress_of(const std::string& path);
// Nothing where there is no such file. Throws std::runtime_error where the file is something else.
std::optional<Progress> read_progress(const std::string& path);
void write_progress(const std::string& path, const Progress& progress);

}  // namespace qdmd::archive
