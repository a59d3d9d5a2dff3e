// SPDX-License-Identifier: LGPL-2.1-or-later
// What an element keeps from one call to the next, and what the two elements do differently.
#pragma once

#include <gst/video/video.h>

#include <array>
#include <bitset>
#include <memory>
#include <mutex>

#include "core/engine/engine.h"
#include "core/model/learnt.h"
#include "gst/backgroundsample.h"
#include "gst/gstqdmdobjects.h"
#include "gst/gstqdmdsettings.h"
#include "gst/latency.h"
#include "gst/pointers.h"
#include "gst/solvereport.h"
#include "gst/streamtime.h"
#include "gst/waitingframes.h"

namespace qdmd {

// What was loaded and waits for the video that it is of.
struct Loaded {
  Learnt learnt;
  CharsPtr file;          // its name, to be shown
  bool at_start = false;  // by load-location: the element does not go on without it
};

// One picture of a frame that leaves, in a buffer with its metadata.
struct OutputPicture {
  Output output = Output::background;
  const GstVideoInfo* info = nullptr;
  BufferPtr buffer;
};

// All that are wanted of one frame.
class OutputPictures {
 public:
  static constexpr size_t kMost = 4;  // one of each kind
  void clear() {
    while (size_ > 0) of_[--size_] = {};
  }
  void add(OutputPicture picture) { of_[size_++] = std::move(picture); }
  bool empty() const { return size_ == 0; }
  OutputPicture* begin() { return of_.data(); }
  OutputPicture* end() { return of_.data() + size_; }

 private:
  std::array<OutputPicture, kMost> of_;
  size_t size_ = 0;
};

class State {
 public:
  // The state of `its`, whose input has this segment. Both live as long as it does.
  State(GstElement* its, const GstSegment* segment);
  virtual ~State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // From the streaming thread, with the stream lock and without the others.
  // Whether somebody is going to ask for masks or cut-outs.
  virtual bool wants_masks(const Settings& settings) const = 0;
  // Whether nobody is going to ask for anything else, as far as it is known.
  virtual bool wants_masks_alone(const Settings& settings) const = 0;
  // Adds the pictures that somebody wants of the frame that left `shell`, not drawn yet. Not OK:
  // what waits is dropped.
  virtual GstFlowReturn make_pictures(GstBuffer* shell, const Settings& settings,
                                      OutputPictures* pictures) = 0;
  // Pushes what is drawn.
  virtual GstFlowReturn send(OutputPictures* pictures) = 0;
  // Forwards an event that was held back.
  virtual void forward(EventPtr event) = 0;
  // Source pads have this event from now on, although nobody was sent it: a sticky one.
  virtual void keep(EventPtr event) = 0;
  // Somebody takes frames after send() had this flow.
  virtual bool goes_on(GstFlowReturn flow) const { return flow == GST_FLOW_OK; }

  GstElement* const element;

  // Protected by the object lock.
  Settings settings;
  Latency latency;  // written with the stream lock, too
  Counters counters;
  bool reset_asked = false;
  // The next caps configure the engine, even if they are of the video that it is configured for.
  bool configure_asked = true;
  SolveReport report;
  CharsPtr load_location;

  // Held while the engine works, by the streaming thread and by a thread that reads `background`;
  // never while something is pushed, queried or posted. The object lock may be taken inside it.
  std::mutex engine_lock;
  // Protected by the engine lock.
  Engine engine;
  BackgroundSample background;
  Colours colours = Colours::rgb;  // of the video that the engine is configured for
  std::unique_ptr<Loaded> loaded;

  // Protected by the stream lock.
  const GstSegment* const segment;  // of what comes in
  GstVideoInfo info = {};           // of the video that the engine is configured for
  // The metadata of the frames that the engine holds: buffers without memory, so that upstream's
  // pools never wait for a window.
  WaitingFrames shells;
  ObjectWatch objects;
  guint64 solves_told = 0, scenes_told = 0, views_told = 0;  // of the engine's
  bool warned_of_no_room = false;
  bool told_ready = false;    // the newest solve's exposure had settled, and somebody was told
  guint ignored_seen = 0;     // Settings::ignored_set of those that were looked at
  bool reduces = false;       // mask-scale was chosen, and is above 1
  bool camera_moved = false;  // in the frame that left last
  std::bitset<kMostSettings> warned;  // of settings without effect, a bit for each id
  StreamTime time;                    // of frames that come in
};

}  // namespace qdmd
