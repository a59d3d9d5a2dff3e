// SPDX-License-Identifier: LGPL-2.1-or-later
// What was learnt, as the bytes of a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/model/learnt.h"

namespace qdmd {

// All numbers have their lowest byte first; floats are as in IEEE 754.
//   magic, 8 bytes; u32 version; u32 width, height; u32 colours; u32 sections, a bit for each of
//   those that may be missing; u32 rows, columns of the grid, or 0; u32 bits of samples below the
//   highest eight, 0 to 8; f64 noise; u64 bytes of the file
//   the picture's three planes; [limits];
//   [earlier: three planes, spread; f32 weights, limits, frames that could have shown it]
//   [places, where there is `earlier`, for each cell: f32 look, look before, of each channel; u32
//   since, before_since, before_until, judged_since, left, absorbed_since; two u64 of who passed;
//   u8 judgement, is_absorbed_news: see LearntPlace]
//   [the bits below the picture's, if there are any: three planes]
//   u64 FNV-1a of all bytes before it
// Version 2 has no places, and does not say how many frames could have shown the background (as
// many as showed it where most did); version 1 has no bits below the picture's either. Both are
// read; a file of another version is refused. If you change what a file holds, or the grid, count
// this up.
constexpr uint32_t kLearntVersion = 3;
constexpr size_t kLearntHeaderBytes = 56;

// `learnt` is whole: as Engine::learnt() made it, or unpack().
std::vector<uint8_t> pack(const Learnt& learnt);

// Says whether a file can be one of these: it has `bytes` bytes and begins with `header`
// (kLearntHeaderBytes of them, or fewer if the file is shorter). Messages call the file "it", and
// say what is wrong with it and what to do.
Status check_header(std::span<const uint8_t> header, uint64_t bytes);

// Reads a whole file. If it is not ok, `learnt` is unchanged. May throw std::bad_alloc; asks for
// hardly more memory than `bytes` have.
Status unpack(std::span<const uint8_t> bytes, Learnt* learnt);

}  // namespace qdmd
