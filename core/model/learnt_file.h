// What was learnt, as the bytes of a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/model/learnt.h"

namespace qdmd {

// All numbers have their lowest byte first; floats are those of IEEE 754.
//   magic, 8 bytes; u32 version; u32 width, height; u32 colours; u32 sections, a bit for each of
//   those that may be missing; u32 rows, columns of the grid, or 0; u32 0; f64 noise; u64 bytes of
//   the file
//   the picture's three planes; [limits]; [earlier: three planes, spread; f32 weights, limits]
//   u64 FNV-1a of all bytes before it
// A file is of this version or refused; whoever changes what it holds, or the grid, counts up.
constexpr uint32_t kLearntVersion = 1;
constexpr size_t kLearntHeaderBytes = 56;

// `learnt` is whole: as Engine::learnt() made it, or unpack().
std::vector<uint8_t> pack(const Learnt& learnt);

// Of a file of `bytes` bytes that begins with `header` (kLearntHeaderBytes, fewer where it ends
// before): whether it can be such a file. The messages here say of "it" what is wrong with the file
// and what to do.
Status check_header(std::span<const uint8_t> header, uint64_t bytes);

// All of a file. Not ok: `learnt` is as it was. Throws std::bad_alloc, for no more memory than
// `bytes` have.
Status unpack(std::span<const uint8_t> bytes, Learnt* learnt);

}  // namespace qdmd
