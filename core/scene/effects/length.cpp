// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {
namespace {

class Length : public Effect {
 public:
  Length(Values values, const StreamSource&) : frames_(values[0]) {}
  void plan(Plan& plan) override { plan.length = static_cast<int64_t>(frames_); }

 private:
  double frames_;
};

constexpr Parameter kParameters[] = {
    {"frames", "frames", 100, 1, 1e9, "frames of the sequence", true},
};

}  // namespace

const EffectInfo kLength = {
    "length", "the sequence ends after a number of frames", 0, 0, kParameters, make_effect<Length>};

}  // namespace qdmd::scene
