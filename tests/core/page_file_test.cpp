// SPDX-License-Identifier: LGPL-2.1-or-later
// Windows whose frames lie in a file: the same pictures, less memory, and refusals that say why.
#include "core/base/page_file.h"

#include <fcntl.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>

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

// How many bytes of files without a name this process has mapped.
uint64_t mapped_bytes(const std::string& folder) {
  std::ifstream maps("/proc/self/maps");
  uint64_t sum = 0;
  for (std::string line; std::getline(maps, line);) {
    if (line.find(folder) == std::string::npos) continue;
    EXPECT_NE(line.find("(deleted)"), std::string::npos) << line;
    uint64_t first = 0, end = 0;
    char dash = 0;
    std::istringstream(line) >> std::hex >> first >> dash >> end;
    sum += end - first;
  }
  return sum;
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
