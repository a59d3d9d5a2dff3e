// SPDX-License-Identifier: LGPL-2.1-or-later
// What the processes of a job know of each other: files beside its first result.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "examples/archive/files.h"
#include "examples/archive/plan.h"

namespace qdmd::archive {

// About a stretch that is whole.
struct StretchFacts {
  int64_t frames = 0, warm_up = 0;  // that were written, and not
  // Of the process that did it, meanwhile; and the most bytes of memory that it ever had.
  double seconds = 0, processor_seconds = 0, most_memory = 0;
};

// The plan; and for each stretch a file that the process at work on it has locked, and one that
// says that it is whole. A process that dies loses its lock, and others do its stretch. All throw
// std::runtime_error.
class JobFolder {
 public:
  explicit JobFolder(const std::string& first_result);
  const std::string& path() const { return path_; }

  // Nothing where there is none.
  std::optional<Plan> read_plan() const;
  void write_plan(const Plan& plan) const;
  // Who plans, or joins, holds it. An empty folder is made where there is none.
  LockedFile hold() const;
  // Nothing where the folder is gone: results are joined, or another process does that.
  std::optional<LockedFile> hold_to_join() const;

  // Of stretch `index`. Nothing: another process has it.
  std::optional<LockedFile> take(size_t index) const;
  std::optional<StretchFacts> facts(size_t index);
  void finish(size_t index, const StretchFacts& facts);
  // Frames that were written of so many stretches, those included that are under way.
  int64_t frames_done(size_t stretches);

  // What another job has left goes. For the process that holds the folder.
  void clear();
  // All of it goes.
  void remove() const;

 private:
  std::string file(const char* name) const;
  std::string of_stretch(size_t index, const char* kind) const;

  std::string path_;
  std::vector<std::optional<StretchFacts>> known_;
};

}  // namespace qdmd::archive
