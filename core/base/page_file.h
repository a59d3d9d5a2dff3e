// SPDX-License-Identifier: LGPL-2.1-or-later
// Memory that lies in a file, for what is larger than the machine's memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "core/base/status.h"

namespace qdmd {

// For a std::unique_ptr to mapped pages.
struct UnmapPages {
  size_t bytes = 0;
  void operator()(uint8_t* pages) const;
};

// Pages of a file without a name, which goes with this object, or with the process however it ends.
// The system keeps those in memory that were used last. The file has its whole size from the
// beginning: a disk cannot fill up under pages that are in use. If the disk fails, the process gets
// SIGBUS, as for every mapped file.
class PageFile {
 public:
  PageFile() = default;
  // Takes `bytes` bytes, 1 at least, of zeros in a file in that folder. Status::bad_folder, with a
  // sentence that says why: nothing has changed.
  Status take(const std::string& folder, uint64_t bytes);

  // At the beginning of a page; null where nothing was taken.
  uint8_t* data() const { return pages_.get(); }

 private:
  std::unique_ptr<uint8_t[], UnmapPages> pages_;
};

}  // namespace qdmd
