// SPDX-License-Identifier: LGPL-2.1-or-later
// What may be wrong with a picture's file that decoders say nothing of.
#pragma once

#include <cstddef>
#include <string_view>

namespace qdmd::archive {

// True for the bytes of a JPEG or PNG whose end is missing: decoders fill up what a JPEG lacks, and
// GStreamer's leaves out the last PNG of a stream. What may come behind the end does not matter.
inline bool is_cut_off(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\x89PNG"sv)) return bytes.rfind("IEND"sv) == bytes.npos;
  if (!bytes.starts_with("\xFF\xD8"sv)) return false;
  // Segments with a length, whose bytes may be those of another picture; then coded samples, in
  // which the marker of the end does not occur.
  size_t at = 2;
  while (at + 4 <= bytes.size() && bytes[at] == '\xFF' && bytes[at + 1] != '\xDA') {
    const auto byte = [&bytes](size_t i) { return static_cast<unsigned char>(bytes[i]); };
    // Any number of them may come before a marker.
    at += byte(at + 1) == 0xFF ? 1 : 2 + size_t{256} * byte(at + 2) + byte(at + 3);
  }
  return at + 4 > bytes.size() || bytes.find("\xFF\xD9"sv, at) == bytes.npos;
}

// True for a PNG with colours of 16 bits, which GStreamer 1.22 mixes up.
inline bool has_deep_colours(std::string_view bytes) {
  using namespace std::string_view_literals;
  constexpr size_t kDepth = 24, kKind = 25;  // of the chunk IHDR, which comes first
  return bytes.starts_with("\x89PNG"sv) && bytes.size() > kKind && bytes[kDepth] == 16 &&
         bytes[kKind] != 0;
}

}  // namespace qdmd::archive
