// SPDX-License-Identifier: LGPL-2.1-or-later
// Memory that lies in a file, for what is larger than the machine's memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/base/status.h"

namespace qdmd {

// For a std::unique_ptr to mapped pages.
struct UnmapPages {
  size_t bytes = 0;
  void operator()(uint8_t* pages) const;
};

// A file that is open, or none.
class OpenFile {
 public:
  explicit OpenFile(int file = -1) : file_(file) {}
  OpenFile(OpenFile&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  OpenFile& operator=(OpenFile&& other) noexcept {
    std::swap(file_, other.file_);
    return *this;
  }
  ~OpenFile();
  int get() const { return file_; }

 private:
  int file_;
};

// Pages of a file without a name, which goes with this object, or with the process however it ends.
// The system keeps those in memory that were used last. The file has its whole size from the
// beginning: a disk cannot fill up under pages that are in use. If the disk fails, the process gets
// SIGBUS, as for every mapped file. A page that is not in memory is read alone, which takes long:
// those who read many ask for them before.
class PageFile {
 public:
  PageFile() = default;
  // Takes `bytes` bytes, 1 at least, of zeros in a file in that folder. Status::bad_folder, with a
  // sentence that says why: nothing has changed.
  Status take(const std::string& folder, uint64_t bytes);

  // At the beginning of a page; null where nothing was taken.
  uint8_t* data() const { return pages_.get(); }

  // These bytes are about to be written anew: nobody needs to read what they held.
  void forget(uint64_t first, uint64_t bytes);
  // These bytes will not change for a while. Their way to the disk begins, so that they can leave
  // memory at once when there is no room.
  void written(uint64_t first, uint64_t bytes) const;
  // These bytes are read soon: their way from the disk begins.
  void will_need(uint64_t first, uint64_t bytes) const;

 private:
  OpenFile file_;
  std::unique_ptr<uint8_t[], UnmapPages> pages_;
};

}  // namespace qdmd
