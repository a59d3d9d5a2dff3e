// SPDX-License-Identifier: LGPL-2.1-or-later
// Results on disk, so that a run that was killed goes on where it was.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/evaluation/clip.h"
#include "tests/evaluation/report.h"

namespace qdmd::evaluation {

// Writes a file that is there whole or not at all. Throws std::runtime_error.
void write_atomically(const std::filesystem::path& path, const std::vector<uint8_t>& bytes);
void write_atomically(const std::filesystem::path& path, const std::string& text);

// SHA-256 in hexadecimal.
std::string digest(const std::string& text);
std::string digest(const cv::Mat& picture);

// A file's path, size and time of change: what a result depends on without reading it.
std::string fingerprint(const std::filesystem::path& path);

// What was measured in one job.
struct Record {
  Row row;
  std::string background;  // digest of the picture
};

// One JSON file a job. The name has the digest of all that the result depends on, so a record that
// is found is valid. A store without a folder keeps nothing.
class Store {
 public:
  Store() = default;
  // Throws std::filesystem::filesystem_error where the folder cannot be made.
  explicit Store(std::filesystem::path folder);

  std::optional<Record> find(const std::string& job, const std::string& key) const;
  void put(const std::string& job, const std::string& key, const Record& record) const;

 private:
  std::filesystem::path path_of(const std::string& job, const std::string& key) const;
  std::filesystem::path folder_;
};

}  // namespace qdmd::evaluation
