// The engine without GStreamer: 8-bit pictures in, background and masks out, each at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

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

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace qdmd::library
