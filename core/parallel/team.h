// Processes that work on the same pictures, and what they tell each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace qdmd {

// What is talked about, so that somebody can count it.
enum class Talk {
  products,    // the Gram matrix
  light,       // how bright frames are
  cells,       // means over the cells of a grid
  statistics,  // distances from the background, once a window
  textures,    // pixels of coarse cells that differ
  masks        // before specks are taken out
};
inline constexpr int kTalks = 6;

// Each member has a band of the pictures' rows (Band). All members call the same functions with the
// same sizes in the same order, from one thread each. What they get is the same to the last bit for
// any number of members: sums are of integers. Somebody else moves the bytes, and decides what
// happens where a member does not answer.
class Team {
 public:
  virtual ~Team() = default;
  virtual int size() const = 0;
  // 0 .. size() - 1: members have their bands in this order, from the top.
  virtual int rank() const = 0;

  // Each value becomes the sum of all members'.
  virtual void sum(Talk about, std::span<int64_t> values) = 0;
  // Member r has written bytes ends[r - 1] (0: the first) .. ends[r] - 1 of `all`; afterwards it
  // has all of them.
  virtual void share(Talk about, std::span<std::byte> all, std::span<const size_t> ends) = 0;
};

}  // namespace qdmd
