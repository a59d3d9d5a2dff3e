// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs a fuzz target without a fuzzer: the inputs in files and folders, and random ones.
//
//   replay FILE_OR_FOLDER...             inputs that are kept, all of them
//   replay --random COUNT [--seed N]     inputs of a generator, the same ones for each seed
//
// Ends with 1 where there was no input: a folder that moved is no success.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/bytes.h"

// A target that has none leaves it 0.
extern "C" __attribute__((weak)) int LLVMFuzzerInitialize(int* argc, char*** argv);

namespace {

namespace fs = std::filesystem;

size_t runs = 0;

void run(const std::vector<uint8_t>& input) {
  // Exactly so many bytes on the heap: one too many shows.
  const std::vector<uint8_t> exact(input);
  LLVMFuzzerTestOneInput(exact.data(), exact.size());
  ++runs;
}

void replay(const fs::path& path) {
  if (!fs::is_directory(path)) {
    std::ifstream file(path, std::ios::binary);
    run({std::istreambuf_iterator<char>(file), {}});
    return;
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& file : files) replay(file);
}

// Bytes of all values, and of few; some inputs are longer than others.
std::vector<uint8_t> random_input(std::mt19937& rng) {
  constexpr uint32_t kLongest = 160;
  std::vector<uint8_t> input(rng() % (rng() % kLongest + 1) + 1);
  const auto values = rng() % 3 == 0 ? rng() % 255 + 2 : 256;
  for (uint8_t& byte : input) byte = static_cast<uint8_t>(rng() % values);
  return input;
}

}  // namespace

int main(int argc, char** argv) {
  if (LLVMFuzzerInitialize) LLVMFuzzerInitialize(&argc, &argv);
  uint32_t seed = 1;
  unsigned long count = 0;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--random") == 0 && i + 1 < argc)
      count = std::stoul(argv[++i]);
    else if (std::strcmp(argv[i], "--seed") == 0 && i + 1 < argc)
      seed = static_cast<uint32_t>(std::stoul(argv[++i]));
    else
      replay(argv[i]);
  }
  std::mt19937 rng(seed);
  for (unsigned long i = 0; i < count; ++i) {
    const auto input = random_input(rng);
    // Whoever looks for the input of a crash runs with this.
    if (const char* keep = std::getenv("QDMD_KEEP_INPUT")) {
      std::ofstream file(keep, std::ios::binary);
      file.write(reinterpret_cast<const char*>(input.data()), static_cast<long>(input.size()));
    }
    run(input);
  }
  std::printf("%zu inputs\n", runs);
  return runs > 0 ? 0 : 1;
}
