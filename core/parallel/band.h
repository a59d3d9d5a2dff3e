// The rows of a picture that a member of a team has.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "core/parallel/team.h"

namespace qdmd {

// A member's own rows, whose pixels it answers for, and above and below some of its neighbours',
// which the decisions about its own look at: these it computes, too, so that no pixel travels. Rows
// count in the picture, or, where that is said, among those that are kept.
class Band {
 public:
  Band() = default;
  // All rows of a picture that is not shared.
  Band(int height) : height_(height), rows_(height), ends_{height} {}  // NOLINT: they are the same
  // The band of one member of `team`, whose member r has own rows from where those of r - 1 end up
  // to ends[r] - 1. halo: rows that are kept beside the own ones on either side, as far as there
  // are any.
  Band(Team* team, std::vector<int> ends, int halo)
      : height_(ends.back()), team_(team), ends_(std::move(ends)) {
    first_ = std::max(0, own_first() - halo);
    rows_ = std::min(height_, own_end() + halo) - first_;
  }

  int height() const { return height_; }  // of the picture
  int first() const { return first_; }    // that is kept
  int rows() const { return rows_; }      // that are kept
  int own_first() const { return begin_of(rank()); }
  int own_end() const { return end_of(rank()); }
  int own_rows() const { return own_end() - own_first(); }
  // The first own row, counted among the kept ones.
  int own_begin() const { return own_first() - first_; }

  // Null: the picture is not shared.
  Team* team() const { return team_; }
  bool is_whole() const { return !team_; }
  // Own rows of any member.
  int members() const { return static_cast<int>(ends_.size()); }
  int begin_of(int rank) const { return rank > 0 ? end_of(rank - 1) : 0; }
  int end_of(int rank) const { return ends_.empty() ? 0 : ends_[static_cast<size_t>(rank)]; }

  // Which of every step-th row of the picture are own ones: the first, and how many.
  int first_sample(int step) const { return (own_first() + step - 1) / step * step; }
  int samples(int step) const { return (own_end() + step - 1) / step - first_sample(step) / step; }

 private:
  int rank() const { return team_ ? team_->rank() : 0; }

  int height_ = 0, first_ = 0, rows_ = 0;
  Team* team_ = nullptr;
  std::vector<int> ends_;
};

}  // namespace qdmd
