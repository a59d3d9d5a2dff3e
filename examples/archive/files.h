// SPDX-License-Identifier: LGPL-2.1-or-later
// Files that are whole or not there, and files that one process holds.
#pragma once

#include <optional>
#include <string>

namespace qdmd::archive {

// Where a file is written before it has its name.
std::string temporary_of(const std::string& path);
// The file at temporary_of(path), which nobody writes any more, is on the disk and then has its
// name. Throws std::runtime_error.
void give_name(const std::string& path);
// All of a small file. Nothing: it is not there. Writing throws std::runtime_error.
std::optional<std::string> read_file(const std::string& path);
void write_file(const std::string& path, const std::string& text);

// A file that is locked as long as this lives and the process does, on whatever machine.
class LockedFile {
 public:
  LockedFile(LockedFile&& other) noexcept;
  LockedFile& operator=(LockedFile&&) = delete;
  ~LockedFile();

  // Nothing: another process has it, or its folder is gone. Throws std::runtime_error where files
  // cannot be locked.
  static std::optional<LockedFile> take(const std::string& path);
  // Waits for it.
  static LockedFile wait_for(const std::string& path);
  // What others may read meanwhile.
  void write(const std::string& text);

 private:
  explicit LockedFile(int file) : file_(file) {}

  int file_;
};

}  // namespace qdmd::archive
