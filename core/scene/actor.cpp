// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/actor.h"

#include <algorithm>
#include <cmath>

#include "core/scene/backdrop.h"

namespace qdmd::scene {
namespace {

constexpr int kPhases = 6, kPeople = 4;
constexpr double kHeight = 0.42;                     // of the frame's
constexpr double kFarFeet = 0.68, kNearFeet = 0.92;  // the rows walked on, shares of the height

Colour cloth(Stream& stream) {
  return {to_level(stream.uniform(25, 230)), to_level(stream.uniform(25, 230)),
          to_level(stream.uniform(25, 230))};
}

}  // namespace

Person::Person(int height, Stream& stream, const Dress& dress, const Box& region) {
  const Colour coat = cloth(stream), trousers = cloth(stream);
  for (int phase = 0; phase < kPhases; ++phase) {
    const Sprite figure = draw_person(height, coat, trousers, static_cast<double>(phase) / kPhases);
    forward_.push_back(dress ? dress(figure, region) : figure);
    backward_.push_back(mirrored(forward_.back()));
  }
}

int person_height(int frame_width, int wanted) {
  return std::clamp(wanted, 1, static_cast<int>(frame_width / kWidthOfPerson) + 1);
}

const Sprite& Person::at(double walked, bool forward) const {
  // Two steps take about the height of a person.
  const double step = walked / std::max(height(), 1);
  const auto phase = static_cast<size_t>((step - std::floor(step)) * kPhases) % kPhases;
  return forward ? forward_[phase] : backward_[phase];
}

Crossing::Crossing(int width, int height, double pause, const StreamSource& streams,
                   const Dress& dress)
    : width_(width), height_(height), pause_(pause), streams_(streams) {
  Stream stream = streams.at(StreamSource::kSetup);
  const int person = person_height(width, static_cast<int>(std::lround(kHeight * height)));
  const int top = static_cast<int>(kFarFeet * height) - person;
  const Box region{0, top, width, static_cast<int>(kNearFeet * height) - top};
  people_.reserve(kPeople);
  for (int i = 0; i < kPeople; ++i) people_.emplace_back(person, stream, dress, region);
}

void Crossing::place(double time, std::vector<Placement>* placements) const {
  const double period = kCrossing + pause_;
  const double pass = std::floor(time / period);
  const double spent = time - pass * period, half = kCrossing / 2;
  const double moving = spent < half ? spent : std::max(half, spent - pause_);

  const auto number = static_cast<int64_t>(pass);
  Stream stream = streams_.unlogged(number);
  const Person& person = people_[static_cast<size_t>(stream.index(kPeople))];
  const double feet = stream.uniform(kFarFeet, kNearFeet) * height_;
  const bool forward = number % 2 == 0;
  const double beyond = kBeyond * width_;
  const double way = moving / kCrossing * (width_ + person.width() + 2 * beyond);
  const double x = forward ? way - person.width() - beyond : width_ + beyond - way;
  placements->push_back({&person.at(way, forward), static_cast<int>(std::lround(x)),
                         static_cast<int>(std::lround(feet)) - person.height(), false, number});
}

}  // namespace qdmd::scene
