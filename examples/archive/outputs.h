// The files of a job, which one process writes: whole windows or nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/foreground/picture.h"
#include "examples/archive/video_writer.h"

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

// A video has a file for each window in a folder beside it, and is joined of these at the end: a
// video that is written to as one cannot be gone on with. A picture of a window's background has
// its name at once: that of the first window as it was given, others with their number.
class Outputs {
 public:
  // picture: of all but masks, which have its size.
  Outputs(std::vector<Wanted> wanted, const GstVideoInfo& picture, double rate,
          std::string encoder);

  // What earlier jobs left, from window `windows` on, is removed.
  void begin_after(int64_t windows);
  // One frame of video `which` of the wanted ones, in window `window`, the first being 0.
  void write(size_t which, int64_t window, std::span<const uint8_t> frame, GstClockTime time);
  // The background of a window. Waits for the window before it, as end_window() does.
  void write_picture(size_t which, int64_t window, std::span<const uint8_t> frame);
  // All of the window was given. While the caller goes on, its files get their names, and then
  // `after` is called, which may throw: the other processes need not wait until a picture is
  // encoded and on the disk. One window at a time: waits for the one before it.
  void end_window(std::function<void()> after);
  // All windows that were given have their names. Throws what went wrong there.
  void wait();
  // Videos of so many windows become one each.
  void join(int64_t windows);
  // What was only there to be joined.
  void remove_parts();

 private:
  // A file that is being written, under the name that it gets.
  struct Open {
    std::string path;
    std::unique_ptr<VideoWriter> writer;
  };

  std::string part_of(size_t which, int64_t window) const;
  Open open(size_t which, const std::string& path, const std::string& encoder) const;

  std::vector<Wanted> wanted_;
  GstVideoInfo picture_, mask_;
  double rate_;
  std::string encoder_;
  std::map<size_t, Open> files_;
  std::future<void> ending_;
};

}  // namespace qdmd::archive
