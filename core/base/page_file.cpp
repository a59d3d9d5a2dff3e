// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/base/page_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <limits>
#include <system_error>

namespace qdmd {
namespace {

// A file that is open, and has no name any more.
class NamelessFile {
 public:
  explicit NamelessFile(std::string path) : file_(mkostemp(path.data(), O_CLOEXEC)) {
    if (file_ >= 0) unlink(path.c_str());
  }
  ~NamelessFile() {
    if (file_ >= 0) close(file_);
  }
  NamelessFile(const NamelessFile&) = delete;
  NamelessFile& operator=(const NamelessFile&) = delete;
  int get() const { return file_; }

 private:
  int file_;
};

Status refused(const std::string& folder, uint64_t bytes, int error) {
  return {Status::Code::bad_folder,
          "The window's frames cannot be kept in '" + folder + "' (" + std::to_string(bytes) +
              " bytes): " + std::generic_category().message(error) +
              ". Set window-on-disk to a folder with more room, or lower window-size."};
}

}  // namespace

void UnmapPages::operator()(uint8_t* pages) const { munmap(pages, bytes); }

Status PageFile::take(const std::string& folder, uint64_t bytes) {
  if (bytes > static_cast<uint64_t>(std::numeric_limits<off_t>::max()))
    return refused(folder, bytes, EFBIG);
  const NamelessFile file(folder + "/qdmd-window-XXXXXX");
  if (file.get() < 0) return refused(folder, bytes, errno);
  int error = 0;
  do {
    error = posix_fallocate(file.get(), 0, static_cast<off_t>(bytes));
  } while (error == EINTR);
  if (error != 0) return refused(folder, bytes, error);
  void* const pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
  if (pages == MAP_FAILED) return refused(folder, bytes, errno);
  pages_ = {static_cast<uint8_t*>(pages), UnmapPages{bytes}};
  return {};
}

}  // namespace qdmd
