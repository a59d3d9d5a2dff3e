// SPDX-License-Identifier: LGPL-2.1-or-later
// The signals `save` and `load`, and the property `load-location`.
#include <glib/gstdio.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "tests/core/learnt_version_2.h"
#include "tests/gst/watched_element.h"

namespace qdmd::test {
namespace {

using Bytes = std::vector<uint8_t>;

// A folder that is gone with its files at the end.
class Folder {
 public:
  Folder() : path_(g_dir_make_tmp("qdmd-save-XXXXXX", nullptr)) {}
  ~Folder() {
    for (const std::string& name : names()) g_remove((path_ + "/" + name).c_str());
    g_rmdir(path_.c_str());
  }
  std::string file(const std::string& name = "room.qdmd") const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    GDir* dir = g_dir_open(path_.c_str(), 0, nullptr);
    while (const gchar* name = g_dir_read_name(dir)) all.emplace_back(name);
    g_dir_close(dir);
    return all;
  }

 private:
  std::string path_;
};

Bytes read(const std::string& file) {
  gchar* contents = nullptr;
  gsize size = 0;
  if (!g_file_get_contents(file.c_str(), &contents, &size, nullptr)) return {};
  const Bytes bytes(contents, contents + size);
  g_free(contents);
  return bytes;
}
void write(const std::string& file, const Bytes& bytes) {
  ASSERT_TRUE(g_file_set_contents(file.c_str(), reinterpret_cast<const gchar*>(bytes.data()),
                                  static_cast<gssize>(bytes.size()), nullptr));
}

Bytes bytes_of(GstBuffer* buffer) {
  Bytes bytes(gst_buffer_get_size(buffer));
  gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
  return bytes;
}

constexpr int kWidth = 40, kHeight = 24;

// What an element of `launch` learns of the still picture with its mover, in a file.
Bytes save_one(const std::string& file, const std::string& launch = "mode=live",
               GstVideoFormat format = GST_VIDEO_FORMAT_RGB) {
  Stream stream("qdmdbackground window-size=16 " + launch, format, kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 40);
  EXPECT_TRUE(element.save(file)) << element.warning();
  EXPECT_EQ("", element.warning());
  return element.background_bytes();
}

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(std::string::npos, text.find(part)) << "\"" << text << "\" lacks \"" << part << "\"";
}

// ---- Round trips ----

TEST(Save, LoadedAndSavedIsTheSameFile) {
  const Folder folder;
  for (const char* launch : {"mode=live", "mode=batch", "mode=live method=qdmd", "method=dmd"}) {
    const Bytes background = save_one(folder.file(), launch);
    Stream stream(std::string("qdmdbackground window-size=16 ") + launch, GST_VIDEO_FORMAT_RGB,
                  kWidth, kHeight);
    Element element(stream);
    EXPECT_TRUE(element.background_bytes().empty());
    ASSERT_TRUE(element.load(folder.file())) << element.warning();
    EXPECT_EQ(background, element.background_bytes()) << launch;
    ASSERT_TRUE(element.save(folder.file("again.qdmd"))) << element.warning();
    EXPECT_EQ(read(folder.file()), read(folder.file("again.qdmd"))) << launch;
    EXPECT_EQ(0u, element.solves());
  }
  EXPECT_EQ(2u, folder.names().size()) << "nothing else is left in the folder";
}

TEST(Save, LiveHasItsBackgroundWithTheFirstFrame) {
  const Folder folder;
  const Bytes background = save_one(folder.file());
  for (bool by_property : {false, true}) {
    Stream stream("qdmdbackground window-size=16 mode=live" +
                      (by_property ? " load-location=" + folder.file() : std::string()),
                  GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
    Element element(stream);
    if (!by_property) {
      ASSERT_TRUE(element.load(folder.file()));
    }
    stream.push_many(5, 1);
    auto out = stream.take_all();
    ASSERT_EQ(1u, out.size());
    EXPECT_EQ(background, bytes_of(out[0].get()));
    g_object_set(element.get(), "output", 2, nullptr);
    stream.push_many(6, 1);
    out = stream.take_all();
    ASSERT_EQ(1u, out.size());
    stream.each_pixel(out[0].get(), [](int x, int y, const uint8_t* rgb, int) {
      // The mover of frame 6 is at 18.
      if (x >= 18 && x < 22 && y >= 4 && y < 9)
        EXPECT_EQ(255, rgb[0]) << x << " " << y;
      else
        EXPECT_EQ(0, rgb[0]) << x << " " << y;
    });
    EXPECT_EQ(0u, element.solves());
    stream.push_many(7, 20);
    EXPECT_GT(element.solves(), 0u);
  }
}

TEST(Save, FrozenBatchComparesWithItAndSolvesNothing) {
  const Folder folder;
  const Bytes background = save_one(folder.file(), "mode=batch");
  Stream stream("qdmdbackground window-size=8 freeze=true load-location=" + folder.file(),
                GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  EXPECT_EQ(background, element.background_bytes());
  stream.push_many(0, 21);
  ASSERT_TRUE(stream.eos());
  const auto out = stream.take_all();
  ASSERT_EQ(21u, out.size());
  for (const auto& buffer : out) EXPECT_EQ(background, bytes_of(buffer.get()));
  EXPECT_EQ(0u, element.solves());
}

TEST(Save, WhileABatchWaitsNoFrameIsLost) {
  const Folder folder;
  save_one(folder.file(), "mode=batch");
  Stream stream("qdmdbackground window-size=8", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  for (int t = 0; t < 30; ++t) {
    stream.push_many(t, 1);
    if (t % 7 == 3) {
      ASSERT_TRUE(element.load(folder.file())) << element.warning();
    }
    EXPECT_TRUE(element.save(folder.file("other.qdmd")) || t < 3) << t;
    if (t < 3) expect_contains(element.warning(), "nothing is learnt yet");
  }
  ASSERT_TRUE(stream.eos());
  const auto out = stream.take_all();
  ASSERT_EQ(30u, out.size());
  for (size_t t = 0; t < 30; ++t) EXPECT_EQ(t * kFrame, GST_BUFFER_PTS(out[t].get()));
  EXPECT_EQ(4u, element.solves());
}

TEST(Save, FormatsOfOneFamilyExchangeFiles) {
  struct Case {
    GstVideoFormat from, to;
    bool fits;
  };
  const Folder folder;
  for (const auto& [from, to, fits] : {Case{GST_VIDEO_FORMAT_RGBx, GST_VIDEO_FORMAT_BGR, true},
                                       {GST_VIDEO_FORMAT_ARGB, GST_VIDEO_FORMAT_GBR, true},
                                       {GST_VIDEO_FORMAT_I420, GST_VIDEO_FORMAT_NV12, true},
                                       {GST_VIDEO_FORMAT_GRAY8, GST_VIDEO_FORMAT_GRAY8, true},
                                       {GST_VIDEO_FORMAT_I420, GST_VIDEO_FORMAT_RGB, false},
                                       {GST_VIDEO_FORMAT_GRAY8, GST_VIDEO_FORMAT_I420, false},
                                       {GST_VIDEO_FORMAT_RGB, GST_VIDEO_FORMAT_GRAY8, false}}) {
    Stream first("qdmdbackground window-size=4", from, kWidth, kHeight);
    Element saver(first);
    for (int t = 0; t < 8; ++t) {
      BufferPtr buffer = make_bytes(first.info(), t);
      first.stamp(buffer.get(), t);
      ASSERT_EQ(GST_FLOW_OK, gst_harness_push(first.harness(), buffer.release()));
    }
    ASSERT_TRUE(saver.save(folder.file())) << saver.warning();
    Stream second("qdmdbackground window-size=4", to, kWidth, kHeight);
    Element loader(second);
    EXPECT_EQ(fits, loader.load(folder.file()));
    EXPECT_EQ(fits, !loader.background_bytes().empty());
    const std::string warning = loader.warning();
    EXPECT_EQ(fits, warning.empty()) << warning;
    if (fits) continue;
    expect_contains(warning, folder.file());
    expect_contains(warning, "video and this video is");
  }
}

TEST(Save, AResetForgetsWhatWasLoadedBefore) {
  const Folder folder;
  const Bytes background = save_one(folder.file());
  for (bool load_again : {false, true}) {
    Stream stream("qdmdbackground window-size=16 mode=live", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
    Element element(stream);
    ASSERT_TRUE(element.load(folder.file()));
    g_signal_emit_by_name(element.get(), "reset");
    if (load_again) {
      ASSERT_TRUE(element.load(folder.file()));
    }
    const BufferPtr frame = stream.make_frame(0, paint_mover);
    stream.push_many(0, 1);
    const auto out = stream.take_all();
    ASSERT_EQ(1u, out.size());
    EXPECT_EQ(load_again ? background : bytes_of(frame.get()), bytes_of(out[0].get()));
  }
}

TEST(Save, AFlushForgetsIt) {
  const Folder folder;
  save_one(folder.file());
  Stream stream("qdmdbackground window-size=16 mode=live load-location=" + folder.file(),
                GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_start()));
  ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_stop(TRUE)));
  EXPECT_FALSE(element.save(folder.file("other.qdmd")));
  expect_contains(element.warning(), "nothing is learnt yet");
}

// A wall with a dark sign, before which a man stands from frame 282 on. The sign's edges are
// stronger than his: without a memory, he would be the background.
void paint_stander(int t, int x, int y, uint8_t rgb[3]) {
  const int left = t < 230 ? -1000 : std::min(44, t - 230 - 8);
  const bool row = y >= 20 && y < 44, man = row && x >= left && x < left + 8;
  const bool sign = row && x >= 44 && x < 52;
  for (int c = 0; c < 3; ++c)
    rgb[c] = static_cast<uint8_t>((man ? 155 : sign ? 60 + 6 * c : 120 + 6 * c) + (x + y + t) % 4);
}

TEST(Save, WhoeverStoodIsForegroundAfterARestart) {
  const Folder folder;
  for (const char* mode : {"live", "batch"}) {
    const std::string launch =
        std::string("qdmdbackground output=mask window-size=50 absorb-time=0 mode=") + mode;
    constexpr int kSaved = 380, kFrames = 160;
    {
      Stream stream(launch, GST_VIDEO_FORMAT_RGB, 96, 64);
      Element element(stream);
      stream.push_many(0, kSaved, paint_stander);
      ASSERT_TRUE(element.save(folder.file())) << element.warning();
    }
    Stream stream(launch + " load-location=" + folder.file(), GST_VIDEO_FORMAT_RGB, 96, 64);
    stream.push_many(kSaved, kFrames, paint_stander);
    const auto out = stream.take_to_end();
    ASSERT_EQ(size_t{kFrames}, out.size());
    for (size_t t = 0; t < kFrames; ++t) {
      int white = 0;
      stream.each_pixel(out[t].get(), [&](int x, int y, const uint8_t* rgb, int) {
        white += x >= 45 && x < 51 && y >= 22 && y < 42 && rgb[0] == 255;
      });
      ASSERT_GT(white, 110) << mode << ", frame " << t;
    }
  }
}

// What is saved of it is in the format of today.
TEST(Save, AFileOfTheVersionBeforeIsLoaded) {
  const Folder folder;
  const Bytes old(kLearntVersion2.begin(), kLearntVersion2.end());
  write(folder.file(), old);
  for (const char* mode : {"live", "batch"}) {
    Stream stream(std::string("qdmdbackground window-size=16 load-location=") + folder.file() +
                      " mode=" + mode,
                  GST_VIDEO_FORMAT_RGB, 8, 6);
    Element element(stream);
    const Bytes background = element.background_bytes();
    ASSERT_EQ(3u * 48, background.size());
    for (size_t i = 0; i < 3 * 48; ++i) EXPECT_EQ(old[56 + i % 3 * 48 + i / 3], background[i]);
    ASSERT_TRUE(element.save(folder.file("again.qdmd"))) << element.warning();
    const Bytes again = read(folder.file("again.qdmd"));
    ASSERT_GT(again.size(), old.size());
    EXPECT_EQ(3, again[8]);
    EXPECT_TRUE(std::equal(old.begin() + 56, old.end() - 8, again.begin() + 56));
    stream.push_many(0, 40);
    EXPECT_EQ(40u, stream.take_to_end().size());
    EXPECT_EQ("", element.warning());
  }
}

// ---- What goes wrong ----

TEST(SaveErrors, NothingIsLearntYet) {
  const Folder folder;
  write(folder.file(), {1, 2, 3});
  Stream stream("qdmdbackground window-size=16", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 10);
  EXPECT_FALSE(element.save(folder.file()));
  const std::string warning = element.warning();
  expect_contains(warning, folder.file());
  expect_contains(warning, "nothing is learnt yet");
  EXPECT_EQ((Bytes{1, 2, 3}), read(folder.file()));
  for (const char* signal : {"save", "load"}) {
    EXPECT_FALSE(call(element.get(), signal, nullptr));
    expect_contains(element.warning(), "name of a file");
    EXPECT_FALSE(call(element.get(), signal, ""));
    expect_contains(element.warning(), "name of a file");
  }
}

TEST(SaveErrors, AFileThatCannotBeWritten) {
  const Folder folder;
  Stream stream("qdmdbackground window-size=4", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 8);
  const std::string nowhere = folder.file("none/room.qdmd");
  for (const std::string& file :
       {nowhere, folder.path(), std::string("/dev/full"), std::string("/proc/qdmd/room")}) {
    EXPECT_FALSE(element.save(file));
    expect_contains(element.warning(), "Cannot save the background to \"" + file + "\"");
  }
  EXPECT_TRUE(folder.names().empty());
  stream.push_many(8, 8);
  EXPECT_EQ(13u, stream.take_all().size());
}

TEST(SaveErrors, AFileThatCannotBeLoadedChangesNothing) {
  const Folder folder;
  save_one(folder.file());
  const Bytes whole = read(folder.file());
  Bytes damaged = whole, newer = whole, shorter = whole, longer = whole, large = whole;
  damaged[500] ^= 4;
  newer[8] = 4;
  shorter.resize(whole.size() / 2);
  longer.push_back(0);
  // 65535 x 65535 pixels.
  large[12] = large[13] = large[16] = large[17] = 0xff;
  write(folder.file("damaged"), damaged);
  write(folder.file("newer"), newer);
  write(folder.file("shorter"), shorter);
  write(folder.file("longer"), longer);
  write(folder.file("large"), large);
  write(folder.file("empty"), {});
  write(folder.file("picture"), {'G', 'I', 'F', '8', '9', 'a'});
  {
    Stream other("qdmdbackground window-size=4", GST_VIDEO_FORMAT_RGB, 32, 20);
    Element element(other);
    other.push_many(0, 8);
    ASSERT_TRUE(element.save(folder.file("size")));
  }

  Stream stream("qdmdbackground window-size=16 mode=live", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  stream.push_many(0, 30, paint_still);
  const Bytes background = element.background_bytes();
  const std::pair<const char*, const char*> cases[] = {
      {"damaged", "checksum"},
      {"newer", "version 4"},
      {"shorter", "bytes in place of"},
      {"longer", "bytes in place of"},
      {"large", "damaged"},
      {"empty", "it is empty"},
      {"picture", "no file that qdmdbackground has saved"},
      {"size", "32x20"},
      {"missing", "No such file"},
      {"", "not a regular file"}};
  for (const auto& [name, what] : cases) {
    EXPECT_FALSE(element.load(folder.file(name))) << name;
    const std::string warning = element.warning();
    expect_contains(warning, "Cannot load the background of \"" + folder.file(name) + "\": ");
    expect_contains(warning, what);
    EXPECT_EQ(background, element.background_bytes()) << name;
  }
  EXPECT_FALSE(element.load("/dev/zero"));
  expect_contains(element.warning(), "not a regular file");
  stream.push_many(30, 10, paint_still);
  EXPECT_EQ(40u, stream.take_all().size());
}

// ---- Pipelines ----

// 20 frames of a ball, and what the element made of them.
class Pipeline {
 public:
  explicit Pipeline(const std::string& properties, const std::string& caps = "format=RGB")
      : pipeline_(gst_parse_launch((std::string("videotestsrc pattern=ball num-buffers=20 ! "
                                                "video/x-raw,width=64,height=48,framerate=25/1,") +
                                    caps + " ! qdmdbackground name=q window-size=8 " + properties +
                                    " ! fakesink name=sink signal-handoffs=true sync=false")
                                       .c_str(),
                                   nullptr)),
        element_(gst_bin_get_by_name(GST_BIN(pipeline_), "q")),
        bus_(gst_element_get_bus(pipeline_)) {
    GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline_), "sink");
    g_signal_connect(sink, "handoff",
                     G_CALLBACK(+[](GstElement*, GstBuffer* buffer, GstPad*, gpointer frames_out) {
                       static_cast<std::vector<Bytes>*>(frames_out)->push_back(bytes_of(buffer));
                     }),
                     &frames);
    gst_object_unref(sink);
  }
  ~Pipeline() {
    stop(GST_STATE_NULL);
    gst_object_unref(bus_);
    gst_object_unref(element_);
    gst_object_unref(pipeline_);
  }
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  GstElement* element() const { return element_; }
  // To its end. What was said meanwhile: "error: .." or "warning: ..".
  std::string play() {
    frames.clear();
    std::string said;
    gst_element_set_state(pipeline_, GST_STATE_PLAYING);
    constexpr auto kKinds =
        GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR | GST_MESSAGE_WARNING);
    for (;;) {
      GstMessage* message = gst_bus_timed_pop_filtered(bus_, 20 * GST_SECOND, kKinds);
      if (!message) return said + "nothing happened";
      const GstMessageType type = GST_MESSAGE_TYPE(message);
      // The source's is about what came of it.
      if (type != GST_MESSAGE_EOS && GST_MESSAGE_SRC(message) == GST_OBJECT(element_)) {
        GError* error = nullptr;
        if (type == GST_MESSAGE_ERROR)
          gst_message_parse_error(message, &error, nullptr);
        else
          gst_message_parse_warning(message, &error, nullptr);
        said += (type == GST_MESSAGE_ERROR ? "error: " : "warning: ") + std::string(error->message);
        g_error_free(error);
      }
      gst_message_unref(message);
      if (type != GST_MESSAGE_WARNING) return said;
    }
  }
  void stop(GstState state) { gst_element_set_state(pipeline_, state); }

  std::vector<Bytes> frames;  // that came out

 private:
  GstElement* pipeline_;
  GstElement* element_;
  GstBus* bus_;
};

TEST(LoadLocation, CountsEachTimeThatTheElementStarts) {
  const Folder folder;
  {
    Pipeline first("mode=live");
    EXPECT_EQ("", first.play());
    EXPECT_TRUE(call(first.element(), "save", folder.file().c_str()));
  }
  Pipeline pipeline("mode=live");
  EXPECT_EQ("", pipeline.play());
  const Bytes alone = pipeline.frames.at(0);
  pipeline.stop(GST_STATE_READY);
  gchar* location = nullptr;
  g_object_get(pipeline.element(), "load-location", &location, nullptr);
  EXPECT_EQ(nullptr, location);
  g_object_set(pipeline.element(), "load-location", folder.file().c_str(), nullptr);
  g_object_get(pipeline.element(), "load-location", &location, nullptr);
  EXPECT_EQ(folder.file(), location);
  g_free(location);
  EXPECT_EQ("", pipeline.play());
  ASSERT_EQ(20u, pipeline.frames.size());
  const Bytes loaded = pipeline.frames[0];
  EXPECT_NE(alone, loaded);
  for (GstState state : {GST_STATE_READY, GST_STATE_NULL}) {
    pipeline.stop(state);
    EXPECT_EQ("", pipeline.play());
    EXPECT_EQ(loaded, pipeline.frames.at(0));
  }
  pipeline.stop(GST_STATE_READY);
  g_object_set(pipeline.element(), "load-location", nullptr, nullptr);
  EXPECT_EQ("", pipeline.play());
  EXPECT_EQ(alone, pipeline.frames.at(0));
}

TEST(LoadLocation, SaysWhatIsWrongAndStops) {
  const Folder folder;
  {
    Pipeline first("mode=live", "format=I420");
    EXPECT_EQ("", first.play());
    EXPECT_TRUE(call(first.element(), "save", folder.file().c_str()));
  }
  write(folder.file("empty"), {});
  const std::string location = "load-location=" + folder.file();
  for (const char* mode : {"mode=live ", "mode=batch "}) {
    {
      Pipeline pipeline(mode + location);
      const std::string said = pipeline.play();
      expect_contains(said, "error: Cannot load the background of \"" + folder.file() + "\"");
      expect_contains(said, "YUV video and this video is RGB");
      EXPECT_TRUE(pipeline.frames.empty());
    }
    for (const char* name : {"empty", "missing"}) {
      Pipeline pipeline(mode + ("load-location=" + folder.file(name)));
      expect_contains(pipeline.play(),
                      "error: Cannot load the background of \"" + folder.file(name) + "\"");
      EXPECT_TRUE(pipeline.frames.empty());
      // It can be mended.
      pipeline.stop(GST_STATE_READY);
      g_object_set(pipeline.element(), "load-location", nullptr, nullptr);
      EXPECT_EQ("", pipeline.play());
      EXPECT_EQ(20u, pipeline.frames.size());
    }
  }
}

TEST(LoadLocation, AWarningWhereItIsSetTooLate) {
  Stream stream("qdmdbackground", GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
  Element element(stream);
  g_object_set(element.get(), "load-location", "/nowhere", nullptr);
  expect_contains(element.warning(), "load-location takes effect when the element starts again");
}

TEST(Load, WaitsForCaps) {
  const Folder folder;
  {
    Pipeline first("mode=live");
    EXPECT_EQ("", first.play());
    EXPECT_TRUE(call(first.element(), "save", folder.file().c_str()));
  }
  Pipeline by_property("mode=live load-location=" + folder.file());
  EXPECT_EQ("", by_property.play());
  Pipeline pipeline("mode=live");
  EXPECT_TRUE(call(pipeline.element(), "load", folder.file().c_str()));
  EXPECT_FALSE(call(pipeline.element(), "load", folder.file("missing").c_str()));
  expect_contains(pipeline.play(), "warning: Cannot load");
  EXPECT_EQ(by_property.frames.at(0), pipeline.frames.at(0));

  // The video turns out to be another: it goes on without.
  Pipeline other("mode=batch", "format=GRAY8");
  EXPECT_TRUE(call(other.element(), "load", folder.file().c_str()));
  const std::string said = other.play();
  expect_contains(said, "warning: Cannot load the background of \"" + folder.file() + "\"");
  EXPECT_EQ(20u, other.frames.size());
}

TEST(Load, AndSaveFromOtherThreads) {
  const Folder folder;
  save_one(folder.file());
  for (const char* mode : {"mode=live", "mode=batch"}) {
    Stream stream(std::string("qdmdbackground window-size=8 hop-size=3 ") + mode,
                  GST_VIDEO_FORMAT_RGB, kWidth, kHeight);
    Element element(stream);
    std::atomic<bool> end = false;
    std::thread loader([&] {
      while (!end) EXPECT_TRUE(element.load(folder.file()));
    });
    std::thread saver([&] {
      for (int i = 0; !end; ++i)
        if (!call(element.get(), "save", folder.file("other").c_str())) g_usleep(100);
    });
    stream.push_many(0, 200);
    end = true;
    loader.join();
    saver.join();
    ASSERT_TRUE(stream.eos());
    EXPECT_EQ(200u, stream.take_all().size());
  }
}

}  // namespace
}  // namespace qdmd::test
