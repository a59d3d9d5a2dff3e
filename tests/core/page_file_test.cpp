// SPDX-License-Identifier: LGPL-2.1-or-later
// Windows whose frames lie in a file: the same pictures, less memory, and refusals that say why.
#include "core/base/page_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <span>
#include <thread>

#include "tests/core/engine_util.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

// A folder that goes with this object.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / "qdmd-page-file-test-XXXXXX") {
    std::string name = path_.string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string path() const { return path_.string(); }
  bool is_empty() const { return std::filesystem::is_empty(path_); }

 private:
  std::filesystem::path path_;
};

// The files without a name that this process has mapped.
std::vector<std::span<uint8_t>> mappings(const std::string& folder) {
  std::ifstream maps("/proc/self/maps");
  std::vector<std::span<uint8_t>> found;
  for (std::string line; std::getline(maps, line);) {
    if (line.find(folder) == std::string::npos) continue;
    EXPECT_NE(line.find("(deleted)"), std::string::npos) << line;
    uint64_t first = 0, end = 0;
    char dash = 0;
    std::istringstream(line) >> std::hex >> first >> dash >> end;
    found.emplace_back(reinterpret_cast<uint8_t*>(first), end - first);
  }
  return found;
}

uint64_t mapped_bytes(const std::string& folder) {
  uint64_t sum = 0;
  for (const auto pages : mappings(folder)) sum += pages.size();
  return sum;
}

// What a machine does that has no room for them. False: it did not.
bool leave_memory(std::span<uint8_t> pages) {
  EXPECT_EQ(msync(pages.data(), pages.size(), MS_SYNC), 0);
  std::vector<uint8_t> in_memory((pages.size() + 4095) / 4096);
  // A few of them may be in use by the system.
  for (int turn = 0; turn < 100; ++turn) {
    if (madvise(pages.data(), pages.size(), MADV_PAGEOUT) != 0) return false;
    EXPECT_EQ(mincore(pages.data(), pages.size(), in_memory.data()), 0);
    const auto left = std::count_if(in_memory.begin(), in_memory.end(),
                                    [](uint8_t page) { return (page & 1) != 0; });
    if (10 * left < std::ssize(in_memory)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}
bool leave_memory(const std::string& folder) {
  const auto all = mappings(folder);
  return std::all_of(all.begin(), all.end(),
                     [](std::span<uint8_t> pages) { return leave_memory(pages); });
}

// Pages that this process had to wait for.
long faults() {
  rusage usage{};
  EXPECT_EQ(getrusage(RUSAGE_SELF, &usage), 0);
  return usage.ru_majflt;
}

// What this process has read from disks.
uint64_t bytes_read() {
  std::ifstream io("/proc/self/io");
  for (std::string name, line; io >> name; std::getline(io, line)) {
    uint64_t bytes = 0;
    if (name == "read_bytes:" && io >> bytes) return bytes;
  }
  return 0;
}

TEST(PageFile, IsZerosWithoutAName) {
  const Folder folder;
  constexpr uint64_t kBytes = 100'000;
  {
    PageFile file;
    EXPECT_EQ(file.data(), nullptr);
    const Status status = file.take(folder.path(), kBytes);
    ASSERT_TRUE(status.ok()) << status.message;
    EXPECT_TRUE(folder.is_empty());
    EXPECT_GE(mapped_bytes(folder.path()), kBytes);
    for (uint64_t i = 0; i < kBytes; ++i) ASSERT_EQ(file.data()[i], 0);
    file.data()[kBytes - 1] = 1;
    PageFile other = std::move(file);
    EXPECT_EQ(file.data(), nullptr);  // NOLINT: it says so
    EXPECT_EQ(other.data()[kBytes - 1], 1);
  }
  EXPECT_EQ(mapped_bytes(folder.path()), 0u);
}

TEST(PageFile, SaysWhyThereIsNone) {
  const Folder folder;
  const auto refused = [&](const std::string& where, uint64_t bytes) {
    PageFile file;
    const Status status = file.take(where, bytes);
    EXPECT_EQ(status.code, Status::Code::bad_folder);
    EXPECT_EQ(file.data(), nullptr);
    EXPECT_NE(status.message.find("window-on-disk"), std::string::npos) << status.message;
    return status.message;
  };
  EXPECT_NE(refused(folder.path() + "/none", 100).find("No such file"), std::string::npos);
  refused(folder.path(), UINT64_MAX);
  // As on a full disk.
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit usual{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &usual), 0);
  const rlimit small = {4096, usual.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message = refused(folder.path(), 1 << 20);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &usual), 0);
  std::signal(SIGXFSZ, before);
  EXPECT_NE(message.find(std::to_string(1 << 20)), std::string::npos) << message;
  EXPECT_TRUE(folder.is_empty());
}

// ---- Windows ----

EngineOptions with(EngineOptions options, Mode mode) {
  options.mode = mode;
  return options;
}

TEST(WindowOnDisk, GivesTheSamePictures) {
  const Folder folder;
  std::mt19937 rng(69);
  const Clip clip = moving_box_clip(400, 60, 40, rng);
  for (EngineOptions options : {window_of(12), with(window_of(12), Mode::live), robust_of(12),
                                with(robust_of(12), Mode::live)})
    for (Output output : {Output::background, Output::mask}) {
      const auto in_memory = Strip(clip.pixels, options).run(clip, output);
      options.window_on_disk = folder.path();
      Strip on_disk(clip.pixels, options);
      EXPECT_GT(mapped_bytes(folder.path()), 0u);
      EXPECT_EQ(on_disk.run(clip, output), in_memory);
    }
  EXPECT_EQ(mapped_bytes(folder.path()), 0u);
  EXPECT_TRUE(folder.is_empty());
}

// As if no frame stayed in memory after one came, and after one left. Each frame is asked for
// twice before it leaves, and solves read a part of their window. Slots of a window before are
// written anew, and not read.
TEST(WindowOnDisk, IsReadAFewTimesWhereItHasLeftMemory) {
  const Folder folder;
  constexpr int kWidth = 320, kHeight = 240, kWindow = 12;
  std::mt19937 rng(69);
  const Clip clip = moving_box_clip(kWidth * kHeight, 3 * kWindow, 400, rng);
  EngineOptions options = robust_of(kWindow);
  const auto in_memory = run_engine(clip, kWidth, kHeight, options, Output::mask);
  options.window_on_disk = folder.path();
  Engine engine;
  ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  const long faults_before = faults();
  const uint64_t before = bytes_read(),
                 frame = mapped_bytes(folder.path()) /
                         static_cast<uint64_t>(layout_of(options, kWidth, kHeight).capacity);
  std::vector<std::vector<uint8_t>> on_disk;
  const auto take = [&] {
    while (engine.next()) {
      if (!leave_memory(folder.path())) return false;
      PackedPicture picture(kWidth, kHeight);
      engine.next()->pop(Output::mask, picture.out());
      on_disk.push_back(picture.planes());
    }
    return true;
  };
  const char* const kStay = "files of this folder do not leave memory";
  for (const auto& pixels : clip.frames) {
    PackedPicture picture(kWidth, kHeight);
    picture.fill(pixels);
    if (!leave_memory(folder.path())) GTEST_SKIP() << kStay;
    ASSERT_TRUE(engine.push(picture.in()).ok());
    if (!take()) GTEST_SKIP() << kStay;
  }
  ASSERT_TRUE(engine.drain().ok());
  if (!take()) GTEST_SKIP() << kStay;
  EXPECT_EQ(on_disk, in_memory);
  const uint64_t read = bytes_read() - before;
  if (read == 0) GTEST_SKIP() << folder.path() << " is on no disk";
  EXPECT_LT(2 * read, 5 * clip.size() * frame);
  // Pages are fetched together.
  EXPECT_LT(faults() - faults_before, static_cast<long>(read / 4096 / 10));
}

TEST(WindowOnDisk, DoesNotCountAgainstMaxMemory) {
  EngineOptions options = robust_of(100);
  const EngineLayout in_memory = layout_of(options, 640, 480);
  options.window_on_disk = std::filesystem::temp_directory_path().string();
  const EngineLayout on_disk = layout_of(options, 640, 480);
  EXPECT_EQ(on_disk.frame_bytes, in_memory.frame_bytes);
  EXPECT_EQ(on_disk.store_bytes, in_memory.store_bytes - in_memory.frame_bytes);
  EXPECT_EQ(on_disk.bytes, in_memory.bytes - in_memory.frame_bytes);
  options.max_memory = on_disk.bytes;
  EXPECT_TRUE(check_options(options, 640, 480).ok());
  options.window_on_disk.clear();
  EXPECT_EQ(check_options(options, 640, 480).code, Status::Code::too_much_memory);
  options.window_on_disk = "/";
  --options.max_memory;
  const Status status = check_options(options, 640, 480);
  EXPECT_EQ(status.code, Status::Code::too_much_memory);
  EXPECT_EQ(status.message.find("for its frames"), std::string::npos) << status.message;
}

TEST(WindowOnDisk, LeavesAnEngineThatIsRefusedClosed) {
  const Folder folder;
  EngineOptions options = window_of(8);
  Engine engine;
  ASSERT_TRUE(engine.configure(options, 40, 1).ok());
  options.window_on_disk = folder.path() + "/none";
  EXPECT_EQ(engine.configure(options, 40, 1).code, Status::Code::bad_folder);
  PackedPicture picture(40, 1);
  EXPECT_EQ(engine.push(picture.in()).code, Status::Code::not_configured);
  options.window_on_disk = folder.path();
  EXPECT_TRUE(engine.configure(options, 40, 1).ok());
  EXPECT_TRUE(engine.push(picture.in()).ok());
  EXPECT_LT(engine.report().bytes, layout_of(window_of(8), 40, 1).bytes);
}

}  // namespace
}  // namespace qdmd::test
