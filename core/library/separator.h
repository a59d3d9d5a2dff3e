// SPDX-License-Identifier: LGPL-2.1-or-later
// The engine without GStreamer: pictures in, backgrounds and masks out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace qdmd::library {

// Options have the names and the meaning of the properties of qdmdbackground; docs/element.md says
// more of each.
enum class Mode {
  live,  // each frame leaves at once, against the newest background
  batch  // window_size - 1 frames later, against the background of its own window
};
enum class Method {
  robust,  // backgrounds without ghosts
  qdmd,    // the paper's: quaternion dynamic mode decomposition
  dmd      // exact DMD of each channel
};
enum class Amplitude { window, first_frame };
enum class Solver { gram, gram_extended, qr, adjoint, automatic };
enum class Estimator { exact, forward_backward, total, optimized };
enum class Stabilize { off, translation, similarity };
// What masks make of the background in another light; marked: 127.
enum class Shadows { background, foreground, marked };

// Pixels x .. x + width - 1 of rows y .. y + height - 1.
struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
};

// The defaults are those of qdmdbackground in mode=live at 25 frames/s.
struct Options {
  Mode mode = Mode::live;
  Method method = Method::robust;
  int window_size = 100;       // frames that are decomposed together, 2 to 2048
  int hop_size = 0;            // frames between solves in mode=live; 0: a quarter of window_size
  int rank = 0;                // singular values that are kept; 0: chosen by the method
  double omega_threshold = 0;  // rad/frame; 0: the mode nearest the origin alone
  Amplitude amplitude = Amplitude::window;
  Solver solver = Solver::automatic;
  Estimator estimator = Estimator::exact;
  int sample_step = 0;                           // pixels, up to 64; 0: chosen
  int iterations = 1;                            // of Method::robust, up to 20
  Stabilize stabilize = Stabilize::translation;  // follow a camera that shakes by some pixels
  bool stabilize_output = false;                 // pictures as if the camera stood still
  double foreground_threshold = 0;               // levels, up to 442; 0: from the noise
  Shadows shadows = Shadows::background;
  int mask_softness = 0;          // pixels over which the edge of a mask fades, up to 15
  std::vector<Rectangle> ignore;  // at most 64: nothing is foreground there
  int absorb_frames = 7500;       // until what came and stands is background; 0: never
  // Frames per second: below 5 masks treat them as a time lapse. Times of objects are counted by
  // it.
  double frame_rate = 25;
  double time_budget = 0;  // milliseconds that a frame may take on average; 0: no limit
  // Masks are found in a picture so many times smaller in each direction: 1, 2 or 4. Other pictures
  // have no more pixels than that, either. 0: 1, unless the first frame comes by apply() and has
  // more than 2.5 million pixels: then 2, and 4 above 20 million.
  int mask_scale = 0;
  int threads = 0;                          // up to 256; 0: one for each core. Changes no result
  uint64_t max_memory = uint64_t{4} << 30;  // bytes
  // A folder where the frames of the window lie in a file, for windows that are larger than the
  // machine's memory; empty: in memory.
  std::string window_on_disk;
  // Things are followed: objects() and on_event().
  bool follow_objects = false;
  double object_min_size = 1.0 / 60;  // longer side of what is told of, parts of the height
  // Seconds, as qdmdbackground's properties object-appear-time, object-stop-time, object-gone-time
  // and motion-end-time.
  double appear_seconds = 0.2, stop_seconds = 2, gone_seconds = 1, motion_end_seconds = 3;
};

// What the samples of a pixel are, in this order. Alpha is taken along and decides nothing.
enum class Pixels { grey, rgb, bgr, rgba, bgra };

// How the samples of a picture lie: interleaved, rows at any distance.
struct Layout {
  int width = 0, height = 0;  // pixels, at least 1
  // From one row to the next; not less than a row's pixels take. Negative: the first row is the
  // last one in memory.
  ptrdiff_t row_bytes = 0;
  Pixels pixels = Pixels::rgb;
  // Bits of a sample. 8: it is a byte. 9 to 16: the lowest bits of a little-endian word.
  int depth = 8;
};

enum class Output {
  background,  // L(t)
  foreground,  // abs(frame - L(t)), per channel
  mask,        // 255 where something is not background
  cutout       // the frame where the mask is set, elsewhere black (transparent with alpha)
};

// A box around foreground.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;  // pixels
  int area = 0;                             // pixels of foreground inside
  double mean_residual = 0;                 // of these: levels from the background
};

// A thing in the newest frame that left, by its number, which no other thing of the separator has.
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
  removed,        // something that belonged to the background was taken; Mode::live only
  moved_on,       // what stopped, or was left behind, goes on
  gone,           // nothing showed it for gone_seconds
  motion_begins,  // something moves in the picture; of no object
  motion_ends     // nothing has moved for motion_end_seconds; of no object
};

struct ObjectEvent {
  Event event;
  Object object;   // all 0 where it is of none
  uint64_t frame;  // the frame it is told with; the first that left is 0, whatever was reset since
  bool cut_off;    // gone and motion_ends: frames ended before
};

// Separates the frames of one camera, in their order. All calls come from one thread at a time.
// Throws std::invalid_argument with a sentence that says what to change where options, a layout or
// bytes are refused: nothing has changed then. Throws std::bad_alloc where memory runs out: all is
// forgotten then.
class [[gnu::visibility("default")]] Separator {
 public:
  explicit Separator(const Options& options = {});
  ~Separator();
  Separator(Separator &&) noexcept;
  Separator& operator=(Separator&&) noexcept;

  // Mode::live: learns from a frame and decides its mask: width * height bytes, rows
  // `mask_row_bytes` apart, 255 where something is not background. A frame of another size, depth
  // or kind of colours begins anew.
  void apply(const void* frame, const Layout& layout, uint8_t* mask, ptrdiff_t mask_row_bytes);

  // Any mode, for more than the mask. A frame goes in; while ready(), frames leave one after the
  // other: any number of pictures are written of each, and skip() lets it go. push() is refused
  // while ready().
  void push(const void* frame, const Layout& layout);
  bool ready() const;
  // Of the frame that leaves next. layout: of the picture, which has the frame's size. Its depth is
  // the frame's, or 8: the highest bits. Only masks of frames with colours can be grey.
  void write(Output output, const Layout& layout, void* picture);
  // The regions of its foreground, the largest first, 64 at most. least_area: pixels of foreground
  // that a region has at least; 0: 1/2000 of the picture, at least 4, and no narrow strips along an
  // edge.
  std::vector<Region> regions(int least_area = 0);
  void skip();
  // No frame follows: makes all frames ready that wait. The next one begins a new window.
  void drain();

  // The newest background. False: there is none, or frames have another size.
  bool background(const Layout& layout, void* picture);
  // What the frames are; of width 0 before the first. row_bytes is 0.
  Layout frames() const;
  // While on, the background stays as it is.
  void freeze(bool freeze);
  // Options::ignore from the next frame on.
  void ignore(const std::vector<Rectangle>& areas);
  // Forgets the frames, the window and the background, and objects as end() does.
  void reset();

  // What the newest frame shows of which a picture was written, or that left, if
  // Options::follow_objects.
  std::vector<Object> objects() const;
  // Called with each event of a frame, once: by the first write(), when the picture is written, or
  // else by skip(); by apply(), once the mask is written; and by end(). It may call nothing of the
  // separator but objects(). Empty: nobody is told.
  void on_event(std::function<void(const ObjectEvent&)> tell);
  // No frame comes any more, or the next is of another time: each object that appeared is gone, cut
  // off. Mode::batch: drain() first, and let the frames leave. reset() does so, too, and a frame
  // of another size, depth or kind of colours.
  void end();

  // What was learnt, as the bytes of a file of the signal `save` of qdmdbackground; empty where
  // nothing is learnt yet.
  std::vector<uint8_t> save();
  // Goes on from there. Frames of another size or kind of colours are refused.
  void load(const uint8_t* bytes, size_t size);
  // From and to files. Throw std::runtime_error where the file cannot be written or read.
  void save(const std::string& file);
  void load(const std::string& file);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace qdmd::library
