// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/store.h"

#include <glib.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <stdexcept>

namespace qdmd::evaluation {

namespace fs = std::filesystem;

namespace {

std::string sha256(const void* data, size_t size) {
  const std::unique_ptr<gchar, decltype(&g_free)> hex(
      g_compute_checksum_for_data(G_CHECKSUM_SHA256, static_cast<const guchar*>(data), size),
      g_free);
  return hex.get();
}

}  // namespace

void write_atomically(const fs::path& path, const std::vector<uint8_t>& bytes) {
  fs::path part = path;
  part += ".part" + std::to_string(getpid());
  std::ofstream file(part, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  std::error_code error;
  if (file) fs::rename(part, path, error);
  if (!file || error) {
    fs::remove(part, error);
    throw std::runtime_error("cannot write " + path.string());
  }
}

void write_atomically(const fs::path& path, const std::string& text) {
  write_atomically(path, std::vector<uint8_t>(text.begin(), text.end()));
}

std::string digest(const std::string& text) { return sha256(text.data(), text.size()); }

std::string digest(const cv::Mat& picture) {
  const cv::Mat whole = picture.isContinuous() ? picture : picture.clone();
  return digest(std::to_string(whole.cols) + "x" + std::to_string(whole.rows) + " " +
                sha256(whole.data, whole.total() * whole.elemSize()));
}

std::string fingerprint(const fs::path& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  const auto time = fs::last_write_time(path, error).time_since_epoch().count();
  return path.string() + "|" + std::to_string(size) + "|" + std::to_string(time) + "\n";
}

Store::Store(fs::path folder) : folder_(std::move(folder)) { fs::create_directories(folder_); }

fs::path Store::path_of(const std::string& job, const std::string& key) const {
  return folder_ / (job + "_" + digest(key).substr(0, 32) + ".json");
}

std::optional<Record> Store::find(const std::string& job, const std::string& key) const {
  if (folder_.empty()) return std::nullopt;
  std::ifstream file(path_of(job, key));
  if (!file) return std::nullopt;
  try {
    const auto json = nlohmann::json::parse(file);
    return Record{row_from(json.at("row")), json.at("background").get<std::string>()};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;  // damaged: measured again
  }
}

void Store::put(const std::string& job, const std::string& key, const Record& record) const {
  if (folder_.empty()) return;
  const nlohmann::ordered_json json{{"row", to_json(record.row)},
                                    {"background", record.background}};
  write_atomically(path_of(job, key),
                   json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

}  // namespace qdmd::evaluation
