// SPDX-License-Identifier: LGPL-2.1-or-later
// Fuzz target: folders of pictures, as the evaluation tool reads them, of any names and bytes.
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace qdmd;
namespace fs = std::filesystem;

// In memory where there is such a folder, and gone with the process.
class Folder {
 public:
  Folder() {
    std::string name =
        (fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) /
        "qdmd-fuzz-XXXXXX";
    QDMD_DEMAND(mkdtemp(name.data()));
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }
  void empty() {
    for (const auto& entry : fs::directory_iterator(path_)) fs::remove_all(entry.path());
  }

 private:
  fs::path path_;
};

const char* const kFolders[] = {"input",   "gt", "GT",        "groundtruth", "gt/masks",
                                "a/input", "a",  "a/b/input", "input/deep",  "."};
const char* const kStems[] = {"1",   "2",    "10",        "in000001", "GT_1",
                              "gt1", "gt2",  "DERIVED_1", "",         "99999999999999999999999",
                              "-1",  "in 3", "\xff\xfe",  ".hidden",  "gt"};
const char* const kEndings[] = {".ppm", ".pgm", ".bmp", ".png", ".jpg", ".PNG", ".txt", ""};

std::string number(fuzz::Bytes* bytes) { return std::to_string(bytes->any_int()); }

std::string header(const std::string& kind, fuzz::Bytes* bytes) {
  std::string text = "P";
  text += kind + "\n";
  text += number(bytes) + " ";
  text += number(bytes) + "\n";
  return text;
}

// A picture whose header may lie about its size, in the formats that are read by OpenCV's own code.
std::string any_picture(fuzz::Bytes* bytes) {
  std::string file;
  switch (bytes->below(6)) {
    case 0:
      return bytes->text(64);
    case 1:
      file = header("6", bytes);
      file += number(bytes) + "\n";
      break;
    case 2:
      file = header(std::to_string(bytes->below(10)), bytes);
      break;
    case 3: {
      file.assign(54, '\0');
      file[0] = 'B', file[1] = 'M', file[10] = 54, file[14] = 40, file[26] = 1;
      file[28] = static_cast<char>(bytes->once_in(2) ? 24 : bytes->byte());
      for (size_t at : {size_t{18}, size_t{22}}) {
        const auto value = static_cast<uint32_t>(bytes->any_int());
        for (size_t i = 0; i < 4; ++i) file[at + i] = static_cast<char>(value >> (8 * i));
      }
      break;
    }
    default: {
      const int width = bytes->from(1, 4), height = bytes->from(1, 4);
      file = "P6\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
      for (int i = 0; i < 3 * width * height; ++i) file.push_back(static_cast<char>(bytes->byte()));
      // It may end too early.
      file.resize(file.size() - static_cast<size_t>(bytes->below(4)));
      return file;
    }
  }
  return file + bytes->text(48);
}

// What was read is whole.
void read(const evaluation::Sequence& sequence, fuzz::Bytes* bytes) {
  evaluation::Selection selection;
  selection.start = static_cast<size_t>(bytes->below(4));
  selection.every = static_cast<size_t>(bytes->from(1, 3));
  selection.frames = static_cast<size_t>(bytes->below(4));
  selection.thin = static_cast<size_t>(bytes->below(4));
  selection.reverse = bytes->once_in(2);
  try {
    const auto clip = evaluation::read_clip(sequence, selection);
    QDMD_DEMAND(!clip.frames.empty());
    const cv::Size first = clip.frames.front().size();
    for (const cv::Mat& frame : clip.frames)
      QDMD_DEMAND(frame.type() == CV_8UC3 && frame.size() == first);
    QDMD_DEMAND(clip.truth.empty() || clip.truth.size() == first);
    QDMD_DEMAND(clip.labels.empty() || clip.labels.size() == clip.frames.size());
    for (const cv::Mat& labels : clip.labels)
      QDMD_DEMAND(labels.empty() || (labels.type() == CV_8UC1 && labels.size() == first));
  } catch (const std::runtime_error& refused) {
    QDMD_DEMAND(refused.what()[0] != 0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  // A picture that says to be as large as memory is refused in any case: not that it is filled.
  setenv("OPENCV_IO_MAX_IMAGE_PIXELS", "1048576", 0);
  // Decoders write what they think of a picture.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static Folder folder;
  folder.empty();
  fuzz::Bytes bytes(data, size);
  for (int files = bytes.from(1, 6); files > 0; --files) {
    // Most are where they belong.
    const fs::path inside =
        folder.path() / kFolders[bytes.once_in(2) ? 0 : bytes.below(std::size(kFolders))];
    const fs::path file =
        inside / (std::string(kStems[bytes.below(std::size(kStems))]) +
                  kEndings[bytes.once_in(2) ? 0 : bytes.below(std::size(kEndings))]);
    std::error_code ignored;
    fs::create_directories(inside, ignored);
    if (bytes.once_in(12)) {
      fs::create_directory(file, ignored);
      continue;
    }
    if (bytes.once_in(12)) {
      fs::create_symlink(bytes.once_in(2) ? "nowhere" : "..", file, ignored);
      continue;
    }
    const std::string picture = any_picture(&bytes);
    std::ofstream(file, std::ios::binary).write(picture.data(), static_cast<long>(picture.size()));
  }
  for (const auto& sequence : evaluation::find_sequences(folder.path())) {
    for (const std::string& problem : sequence.problems) QDMD_DEMAND(!problem.empty());
    read(sequence, &bytes);
  }
  return 0;
}
