// The engine without GStreamer: 8-bit pictures in, background and masks out, each at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace qdmd::library {

enum class Method {
  robust,  // backgrounds without ghosts
  qdmd,    // the paper's: quaternion dynamic mode decomposition
  dmd      // exact DMD of each channel
};

// The defaults are those of qdmdbackground in mode=live.
struct Options {
  Method method = Method::robust;
  int window_size = 100;                    // frames that are decomposed together, 2 to 2048
  int hop_size = 0;                         // frames between solves; 0: a quarter of window_size
  bool stabilize = true;                    // follow a camera that shakes by some pixels
  double foreground_threshold = 0;          // levels, up to 442; 0: from the noise
  int absorb_frames = 7500;                 // until what came and stands is background; 0: never
  int threads = 0;                          // up to 256; 0: one for each core. Changes no result
  uint64_t max_memory = uint64_t{4} << 30;  // bytes
  // Things are followed: objects() and on_event(). Times are counted in frames of this rate.
  bool follow_objects = false;
  double frames_per_second = 25;      // above 0
  double object_min_size = 1.0 / 60;  // longer side of what is told of, parts of the height
  // Seconds, as qdmdbackground's properties object-appear-time, object-stop-time, object-gone-time
  // and motion-end-time.
  double appear_seconds = 0.2, stop_seconds = 2, gone_seconds = 1, motion_end_seconds = 3;
};

// A thing in the newest frame, by its number, which no other thing of the separator has.
struct Object {
  int id;
  int x, y, width, height;  // pixels
  int area;                 // foreground pixels
  double speed;             // pixels a second
  double age, standing;  // seconds since it was first seen, and for which it has stood; 0: it moves
  bool appeared;         // on_event() was told of it
};

enum class Event {
  appeared,       // a thing, and no leaf or speck, was seen for appear_seconds
  stopped,        // it came here and stands for stop_seconds
  left_behind,    // it stands, never moved, and what brought it went stop_seconds ago
  removed,        // something that belonged to the background was taken
  moved_on,       // what stopped, or was left behind, goes on
  gone,           // nothing showed it for gone_seconds
  motion_begins,  // something moves in the picture; of no object
  motion_ends     // nothing has moved for motion_end_seconds; of no object
};

struct ObjectEvent {
  Event event;
  Object object;   // all 0 where it is of none
  uint64_t frame;  // the frame it is told with: the first is 0
  bool cut_off;    // gone and motion_ends: frames ended before
};

// How the samples of a picture lie: interleaved, three of a pixel, rows at any distance.
struct Layout {
  int width, height;    // pixels, at least 1
  ptrdiff_t row_bytes;  // from one row to the next
  bool blue_first;      // B G R, as OpenCV has it; else R G B
};

// Separates the frames of one camera, in their order. All calls come from one thread. Throws
// std::invalid_argument with a sentence that says what to change where options or a size are
// refused, and std::bad_alloc where memory runs out: all is forgotten then.
class [[gnu::visibility("default")]] Separator {
 public:
  explicit Separator(const Options& options = {});
  ~Separator();
  Separator(Separator &&) noexcept;
  Separator& operator=(Separator&&) noexcept;

  // Learns from a frame and decides its mask: width * height samples, rows `mask_row_bytes` apart,
  // 255 where something is not background. A frame of another size begins anew.
  void apply(const uint8_t* frame, const Layout& layout, uint8_t* mask, ptrdiff_t mask_row_bytes);
  // The newest background. False: no frame was applied, or the size is another.
  bool background(const Layout& layout, uint8_t* picture);
  // While on, the background stays as it is.
  void freeze(bool freeze);

  // What the newest frame shows, if Options::follow_objects.
  std::vector<Object> objects() const;
  // Called by apply(), once the mask is written, and by end(), with each event; it may call nothing
  // of the separator but objects(). Empty: nobody is told.
  void on_event(std::function<void(const ObjectEvent&)> tell);
  // No frame comes any more, or the next is of another time: each object that appeared is gone, cut
  // off. A frame of another size does so, too.
  void end();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace qdmd::library
