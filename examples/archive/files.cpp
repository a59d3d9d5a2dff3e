// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>

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

std::optional<std::string> read_file(const std::string& path) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  return std::string{std::istreambuf_iterator<char>(file), {}};
}

void write_file(const std::string& path, const std::string& text) {
  {
    std::ofstream file(temporary_of(path));
    file << text;
    if (!file.flush()) throw std::runtime_error(path + " cannot be written: is the disk full?");
  }
  give_name(path);
}

LockedFile::LockedFile(LockedFile&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

LockedFile::~LockedFile() {
  if (file_ >= 0) close(file_);
}

std::optional<LockedFile> LockedFile::take(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0 && errno == ENOENT) return std::nullopt;
  if (file < 0) throw std::runtime_error(path + " cannot be written: " + std::strerror(errno));
  LockedFile locked(file);
  if (flock(file, LOCK_EX | LOCK_NB) == 0) {
    // The process that had it may have removed it.
    struct stat here, there;
    if (fstat(file, &here) != 0 || stat(path.c_str(), &there) != 0 || here.st_ino != there.st_ino)
      return std::nullopt;
    locked.write("");
    return locked;
  }
  if (errno == EWOULDBLOCK || errno == EINTR) return std::nullopt;
  throw std::runtime_error(path + " cannot be locked (" + std::strerror(errno) +
                           "): this folder's file system has no locks");
}

LockedFile LockedFile::wait_for(const std::string& path) {
  for (;;) {
    if (auto locked = take(path)) return std::move(*locked);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

void LockedFile::write(const std::string& text) {
  // Nobody depends on it.
  if (ftruncate(file_, 0) == 0) std::ignore = pwrite(file_, text.data(), text.size(), 0);
}

}  // namespace qdmd::archive
