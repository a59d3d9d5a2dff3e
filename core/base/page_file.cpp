// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/base/page_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <system_error>

namespace qdmd {
namespace {

uint64_t page_size() {
  static const auto kSize = static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  return kSize;
}

Status refused(const std::string& folder, uint64_t bytes, int error) {
  return {
      Status::Code::bad_folder,
      "The window's frames cannot be kept in '" + folder + "' (" + std::to_string(bytes) +
          " bytes): " + std::generic_category().message(error) +
          (error == ENOSPC || error == EFBIG || error == EDQUOT
               ? ". Set window-on-disk to a folder with more room, or lower window-size."
               : ". Set window-on-disk to a folder that exists and that files can be made in.")};
}

}  // namespace

OpenFile::~OpenFile() {
  if (file_ >= 0) close(file_);
}

void UnmapPages::operator()(uint8_t* pages) const { munmap(pages, bytes); }

Status PageFile::take(const std::string& folder, uint64_t bytes) {
  if (bytes > static_cast<uint64_t>(std::numeric_limits<off_t>::max()))
    return refused(folder, bytes, EFBIG);
  std::string path = folder + "/qdmd-window-XXXXXX";
  OpenFile file(mkostemp(path.data(), O_CLOEXEC));
  if (file.get() < 0) return refused(folder, bytes, errno);
  unlink(path.c_str());
  int error = 0;
  do {
    error = posix_fallocate(file.get(), 0, static_cast<off_t>(bytes));
  } while (error == EINTR);
  if (error != 0) return refused(folder, bytes, error);
  void* const pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
  if (pages == MAP_FAILED) return refused(folder, bytes, errno);
  // What the system would read beside a page that is missing is mostly not what is read next.
  madvise(pages, bytes, MADV_RANDOM);
  pages_ = {static_cast<uint8_t*>(pages), UnmapPages{bytes}};
  file_ = std::move(file);
  return {};
}

// Errors are none in what follows: without it all takes longer. Whole pages alone: the others have
// neighbours that are in use.
void PageFile::forget(uint64_t first, uint64_t bytes) {
  const uint64_t page = page_size(), begin = (first + page - 1) / page * page,
                 end = (first + bytes) / page * page;
  if (begin < end)
    fallocate(file_.get(), FALLOC_FL_ZERO_RANGE, static_cast<off_t>(begin),
              static_cast<off_t>(end - begin));
  // All at once, which reads nothing where that was done.
  will_need(first, bytes);
}

void PageFile::written(uint64_t first, uint64_t bytes) const {
  sync_file_range(file_.get(), static_cast<off_t>(first), static_cast<off_t>(bytes),
                  SYNC_FILE_RANGE_WRITE);
}

// The system does no more at once than it would read ahead by itself.
void PageFile::will_need(uint64_t first, uint64_t bytes) const {
  constexpr uint64_t kAtOnce = uint64_t{1} << 17;
  const uint64_t end = first + bytes;
  for (uint64_t begin = first / page_size() * page_size(); begin < end; begin += kAtOnce)
    madvise(pages_.get() + begin, std::min(kAtOnce, end - begin), MADV_WILLNEED);
}

}  // namespace qdmd
