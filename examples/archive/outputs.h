// SPDX-License-Identifier: LGPL-2.1-or-later
// The files of a job: whole or nothing.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/foreground/picture.h"

namespace qdmd::archive {

// What is wanted, by the file's name: videos end in .mkv, pictures of backgrounds in .png.
struct Wanted {
  Output output = Output::background;
  std::string path;

  bool is_picture() const;
};

// Throws std::invalid_argument with a sentence for the user, and std::runtime_error where what is
// read would be replaced, removed or added to by what is wanted or by `report` (a file's name, or
// "-", or empty).
void check_wanted(const std::vector<Wanted>& wanted, const std::vector<std::string>& recordings,
                  const std::string& report);

// A video has a file for each stretch in a folder beside it, and is joined of these at the end. A
// picture of a window's background has its name at once: that of the first window as it was given,
// others with their number.
std::string part_of(const std::string& path, size_t stretch);
std::string picture_of(const std::string& path, int64_t window);

// What earlier jobs left is removed. Throws std::runtime_error, as below.
void begin_parts(const std::vector<Wanted>& wanted);
// The parts of these stretches are there.
void check_parts(const std::vector<Wanted>& wanted, const std::vector<size_t>& stretches);
// The parts of these stretches become one video each.
void join_parts(const std::vector<Wanted>& wanted, const std::vector<size_t>& stretches);
// What was only there to be joined.
void remove_parts(const std::vector<Wanted>& wanted);

}  // namespace qdmd::archive
