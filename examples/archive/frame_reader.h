// Frames of recordings, of which a process keeps some rows only.
#pragma once

#include <gst/video/video.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/image_view.h"
#include "examples/archive/gst_pointers.h"
#include "gst/videoview.h"

namespace qdmd::archive {

struct RecordingInfo {
  int width = 0, height = 0;  // pixels
  double rate = 0;            // frames a second
  // The format of pictures that are made of its frames: I420, Y42B, Y444, GRAY8 or RGB.
  GstVideoInfo picture = {};
};

// Rows of a picture.
struct Rows {
  int first = 0, count = 0;
};

// Reads files one after another as one recording, or a folder's pictures (PNG or JPEG) in the order
// of their names. Whatever can be decoded is; other rows than those that are wanted are cropped
// before anything is converted. Frames keep their colours and how many pixels share a sample of
// them, but have 8 bits and no alpha; if they differ in that, all become like the first. Grey
// pictures become coloured, because others may follow. Throws std::runtime_error with a sentence
// for the user.
class FrameReader {
 public:
  // choose: which rows are wanted, once the size is known. rate: of pictures.
  FrameReader(std::vector<std::string> paths, double rate,
              std::function<Rows(const RecordingInfo&)> choose);
  ~FrameReader();

  // The next frame; false at the end.
  bool next();
  // The rows of it that are wanted, good until the next call; and when it is shown, in nanoseconds
  // from the first one.
  ImageView view() const;
  GstClockTime time() const { return time_; }
  // The share of the recording that was read, 0 .. 1, about.
  double share() const;
  const RecordingInfo& info() const { return info_; }
  // A sentence for each file that was read to an end long before the one that it names.
  const std::vector<std::string>& early_ends() const { return early_ends_; }

 private:
  struct Crop;
  void open();
  bool feed();
  bool next_of_file();
  void note_early_end();
  void take(SamplePtr sample);

  std::vector<std::string> files_, early_ends_;
  bool pictures_ = false;
  double rate_;
  std::function<Rows(const RecordingInfo&)> choose_;
  size_t next_file_ = 0;
  std::unique_ptr<Crop> crop_;
  PipelinePtr pipeline_;
  ElementPtr source_, sink_;
  RecordingInfo info_;
  bool known_ = false;
  SamplePtr sample_;
  std::optional<MappedVideoFrame> frame_;
  // Where the file begins, and where its newest frame ends, in time.
  GstClockTime begin_ = 0, end_ = 0, time_ = 0;
};

}  // namespace qdmd::archive
