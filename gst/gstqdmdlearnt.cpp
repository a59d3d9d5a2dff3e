// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/gstqdmdlearnt.h"

#include <glib/gstdio.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <utility>

#include "core/model/learnt_file.h"

GST_DEBUG_CATEGORY_EXTERN(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace qdmd {
namespace {

// What went wrong, as a sentence about a file; null: nothing.
using Problem = CharsPtr;

constexpr const char* kNoMemory = "there is not enough memory: scale the video down, or free some.";

Problem problem(const char* what) { return Problem(g_strdup(what)); }
Problem problem(const Status& status) {
  return status.ok() ? nullptr : problem(status.message.c_str());
}

struct CloseFile {
  void operator()(FILE* file) const { std::fclose(file); }
};

const char* name_of(Colours colours) {
  return colours == Colours::rgb ? "RGB" : colours == Colours::yuv ? "YUV" : "GRAY";
}

CharsPtr shown(const gchar* file) { return CharsPtr(g_filename_display_name(file ? file : "")); }

// Runs `action` (returning Problem). No exception gets past this.
template <typename Action>
Problem guarded(Action action) {
  try {
    return action();
  } catch (const std::bad_alloc&) {
    return problem(kNoMemory);
  } catch (const std::exception& error) {
    return problem(error.what());
  }
}

Problem read(const gchar* file, Learnt* learnt) {
  if (!file || !*file) return problem("give it the name of a file.");
  GStatBuf info;
  if (g_stat(file, &info) != 0)
    return Problem(g_strdup_printf("%s: check the name and the rights.", g_strerror(errno)));
  // Others may have no end.
  if (!g_file_test(file, G_FILE_TEST_IS_REGULAR))
    return problem("it is not a regular file: check the name.");
  const std::unique_ptr<FILE, CloseFile> open(g_fopen(file, "rb"));
  if (!open) return Problem(g_strdup_printf("%s: check the rights.", g_strerror(errno)));
  // Nothing of its size is taken before that is known to be right.
  const auto size = static_cast<guint64>(info.st_size);
  std::vector<uint8_t> bytes(std::min<guint64>(size, kLearntHeaderBytes));
  const auto fill = [&](size_t from) {
    const size_t count = bytes.size() - from;
    return std::fread(bytes.data() + from, 1, count, open.get()) == count;
  };
  constexpr const char* kUnreadable = "it cannot be read to its end: check the disk.";
  if (!fill(0)) return problem(kUnreadable);
  if (Problem wrong = problem(check_header(bytes, size))) return wrong;
  const size_t header = bytes.size();
  bytes.resize(size);
  if (!fill(header)) return problem(kUnreadable);
  return problem(unpack(bytes, learnt));
}

Problem write(const gchar* file, const std::vector<uint8_t>& bytes) {
  // It would be replaced.
  if (g_file_test(file, G_FILE_TEST_EXISTS) && !g_file_test(file, G_FILE_TEST_IS_REGULAR))
    return problem("it is not a regular file: give another name.");
  GError* error = nullptr;
  if (g_file_set_contents_full(
          file, reinterpret_cast<const gchar*>(bytes.data()), gssize(bytes.size()),
          GFileSetContentsFlags(G_FILE_SET_CONTENTS_CONSISTENT | G_FILE_SET_CONTENTS_DURABLE), 0666,
          &error))
    return nullptr;
  Problem wrong(g_strdup_printf(
      "%s: check that its folder is there, may be written to and has room.", error->message));
  g_error_free(error);
  return wrong;
}

// what: "save .. to" or "load .. of". code: of GST_RESOURCE_ERROR, unless there is no memory.
void post(GstElement* self, GstMessageType type, GstResourceError code, const char* what,
          const gchar* name, const Problem& wrong) {
  if (std::strcmp(wrong.get(), kNoMemory) == 0) code = GST_RESOURCE_ERROR_NO_SPACE_LEFT;
  gst_element_message_full(self, type, GST_RESOURCE_ERROR, code,
                           g_strdup_printf("Cannot %s \"%s\": %s", what, name, wrong.get()),
                           nullptr, __FILE__, __func__, __LINE__);
}
constexpr const char* kSave = "save the background to";
constexpr const char* kLoad = "load the background of";

// With the engine lock: whether the video is one that it may be the background of.
Problem check(const State& state, const Learnt& learnt) {
  if (learnt.colours == state.colours) return problem(state.engine.plan().may_learn_from(learnt));
  return Problem(g_strdup_printf(
      "it is the background of %s video and this video is %s: put videoconvert before the element, "
      "or save the background of such video.",
      name_of(learnt.colours), name_of(state.colours)));
}

// With the engine lock.
Problem give(State& state, const Learnt& learnt) {
  if (Problem wrong = check(state, learnt)) return wrong;
  if (Problem wrong = problem(state.engine.learn_from(learnt))) return wrong;
  // It belongs to no frame.
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  state.background.solved(segment, GST_CLOCK_TIME_NONE, GST_CLOCK_TIME_NONE);
  return nullptr;
}

}  // namespace

bool save_learnt(State& state, const gchar* file) {
  const Problem wrong = guarded([&]() -> Problem {
    if (!file || !*file) return problem("give it the name of a file.");
    Learnt learnt;
    bool known = false;
    {
      const std::lock_guard lock(state.engine_lock);
      known = state.engine.learnt(&learnt);
      learnt.colours = state.colours;
    }
    if (!known)
      return problem(
          "nothing is learnt yet: save after the first solve, and before the element stops.");
    return write(file, pack(learnt));
  });
  const CharsPtr name = shown(file);
  if (wrong) {
    post(state.element, GST_MESSAGE_WARNING, GST_RESOURCE_ERROR_OPEN_WRITE, kSave, name.get(),
         wrong);
    return false;
  }
  GST_INFO_OBJECT(state.element, "saved the background to \"%s\"", name.get());
  return true;
}

bool load_learnt(State& state, const gchar* file) {
  const Problem wrong = guarded([&]() -> Problem {
    auto loaded = std::make_unique<Loaded>();
    if (Problem unread = read(file, &loaded->learnt)) return unread;
    loaded->file = shown(file);
    const std::lock_guard lock(state.engine_lock);
    const bool configured = state.engine.configured();
    GST_OBJECT_LOCK(state.element);
    const bool reset = configured && state.reset_asked;
    // There is nothing to forget yet.
    if (!configured) state.reset_asked = false;
    GST_OBJECT_UNLOCK(state.element);
    if (configured) {
      // What is to be forgotten first may still be in use.
      if (!reset) return give(state, loaded->learnt);
      if (Problem unfit = check(state, loaded->learnt)) return unfit;
    }
    state.loaded.swap(loaded);
    return nullptr;
  });
  const CharsPtr name = shown(file);
  if (wrong) {
    post(state.element, GST_MESSAGE_WARNING, GST_RESOURCE_ERROR_OPEN_READ, kLoad, name.get(),
         wrong);
    return false;
  }
  GST_INFO_OBJECT(state.element, "loaded the background of \"%s\"", name.get());
  return true;
}

bool read_load_location(State& state) {
  GST_OBJECT_LOCK(state.element);
  const CharsPtr location(g_strdup(state.load_location.get()));
  GST_OBJECT_UNLOCK(state.element);
  const Problem wrong = guarded([&]() -> Problem {
    {
      // What somebody loaded by the signal comes before it.
      const std::lock_guard lock(state.engine_lock);
      if (state.loaded && state.loaded->at_start) state.loaded.reset();
      if (state.loaded || !location) return nullptr;
    }
    auto loaded = std::make_unique<Loaded>();
    if (Problem unread = read(location.get(), &loaded->learnt)) return unread;
    loaded->file = shown(location.get());
    loaded->at_start = true;
    const std::lock_guard lock(state.engine_lock);
    state.loaded.swap(loaded);
    return nullptr;
  });
  if (!wrong) return true;
  post(state.element, GST_MESSAGE_ERROR, GST_RESOURCE_ERROR_OPEN_READ, kLoad,
       shown(location.get()).get(), wrong);
  return false;
}

bool apply_loaded(State& state) {
  std::unique_ptr<Loaded> loaded;
  const Problem wrong = guarded([&]() -> Problem {
    const std::lock_guard lock(state.engine_lock);
    loaded = std::move(state.loaded);
    return loaded ? give(state, loaded->learnt) : nullptr;
  });
  if (!wrong) return true;
  // Without what the user has set, the element does not start.
  const bool stop = loaded->at_start;
  post(state.element, stop ? GST_MESSAGE_ERROR : GST_MESSAGE_WARNING, GST_RESOURCE_ERROR_SETTINGS,
       kLoad, loaded->file.get(), wrong);
  return !stop;
}

}  // namespace qdmd
