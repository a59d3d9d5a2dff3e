#include "examples/archive/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

void synchronize(const fs::path& path, int flags) {
  const int file = open(path.c_str(), flags | O_CLOEXEC);
  const bool done = file >= 0 && fsync(file) == 0;
  const int error = errno;
  if (file >= 0) close(file);
  if (!done)
    throw std::runtime_error(path.string() +
                             " cannot be kept on the disk: " + std::strerror(error));
}

}  // namespace

std::string temporary_of(const std::string& path) { return path + ".tmp"; }

void give_name(const std::string& path) {
  const fs::path folder = fs::absolute(path).parent_path();
  synchronize(temporary_of(path), O_RDONLY);
  fs::rename(temporary_of(path), path);
  synchronize(folder, O_RDONLY | O_DIRECTORY);
}

std::string progress_of(const std::string& path) { return path + ".progress"; }

std::optional<Progress> read_progress(const std::string& path) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  try {
    const auto json = nlohmann::json::parse(file);
    return Progress{json.at("settings"), json.at("windows"), json.at("frames"), json.at("ended"),
                    json.value("joined", false)};
  } catch (const nlohmann::json::exception&) {
    throw std::runtime_error(path +
                             " is not the progress of qdmd-archive: remove it to begin anew");
  }
}

void write_progress(const std::string& path, const Progress& progress) {
  {
    std::ofstream file(temporary_of(path));
    file << nlohmann::json{{"settings", progress.settings},
                           {"windows", progress.windows},
                           {"frames", progress.frames},
                           {"ended", progress.ended},
                           {"joined", progress.joined}}
                .dump(2)
         << '\n';
    if (!file.flush()) throw std::runtime_error(path + " cannot be written: is the disk full?");
  }
  give_name(path);
}

}  // namespace qdmd::archive
