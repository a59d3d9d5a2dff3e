// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/description.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace qdmd::scene {
namespace {

constexpr Preset kPresets[] = {
    {"default", "", "one mover before a still street, and nothing else"},
    {"basic", "noise", "SBMnet's category Basic: a mover and mild sensor noise"},
    {"intermittent-motion", "noise,stop,abandon,remove",
     "SBMnet's category Intermittent motion: a person stops, a bag is left, a van drives off that "
     "was background"},
    {"illumination-changes", "noise,fade,light-switch,exposure",
     "SBMnet's category Illumination changes: light fades, lamps are switched, the camera adapts"},
    {"background-motion", "noise,leaves,water,flicker",
     "SBMnet's category Background motion: leaves, water and a screen"},
    {"very-long", "noise,length=20000,fade=0.5:duration=600",
     "SBMnet's category Very long: 20000 frames in which the evening comes"},
    {"very-short", "noise,low-rate=2,length=10",
     "SBMnet's category Very short: ten frames, half a second apart"},
    {"baseline", "shadow=0.3:softness=2,mirror=0.15,noise",
     "CDnet's category Baseline: a mover, a soft shadow and a floor that mirrors a little"},
    {"bad-weather", "snow=3:speed=0.35,noise=3",
     "CDnet's category Bad weather: thick snow before a noisy camera"},
    {"camera-jitter", "shadow=0.3:softness=2,jitter=3,noise",
     "CDnet's category Camera jitter: a camera that shakes by several pixels"},
    {"dynamic-background", "trees,water,noise",
     "CDnet's category Dynamic background: trees near the camera and water"},
    {"intermittent-object-motion", "stop=12,abandon,remove,shadow=0.3:softness=2,noise",
     "CDnet's category Intermittent object motion: a person stops for long, a bag is left, a van "
     "drives off that was background"},
    {"low-framerate", "low-rate=1,leaves,fade=0.3:duration=300,noise",
     "CDnet's category Low framerate: a frame a second, between which leaves and light change"},
    {"night-videos", "night=0.08:gain=15,compression=40",
     "CDnet's category Night videos: little light, a noisy camera and a codec; nobody has "
     "headlights"},
    {"hard-shadows", "bootstrap=2,shadow=0.65:length=0.9:softness=2,noise",
     "CDnet's category Shadow: people with long, dark shadows"},
    {"storm", "night,rain,leaves,jitter,compression",
     "everything at once: a shaking camera in the rain at night, compressed"},
};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\n") - first + 1);
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto end = text.find(separator);
    parts.push_back(trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::string list_of_names() {
  std::ostringstream text;
  text << "Presets are";
  for (const auto& preset : presets()) text << ' ' << preset.name;
  text << "; effects, which are presets too, are";
  for (const EffectInfo* info : effects()) text << ' ' << info->name;
  text << ". Several are joined by commas, as in noise=3,jitter=1.5.";
  return text.str();
}

std::string list_of_parameters(const EffectInfo& info) {
  std::ostringstream text;
  const char* separator = " takes ";
  text << info.name;
  for (const Parameter& parameter : info.parameters) {
    text << separator << parameter.name << " from " << parameter.minimum << " to "
         << parameter.maximum;
    if (*parameter.unit) text << ' ' << parameter.unit;
    if (parameter.whole) text << " (whole numbers)";
    separator = ", ";
  }
  text << ", as in " << info.name << '=' << info.parameters.front().standard;
  if (info.parameters.size() > 1)
    text << ':' << info.parameters[1].name << '=' << info.parameters[1].standard;
  text << '.';
  return text.str();
}

// The parts of what is wrong, joined; the last one says what is allowed.
template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  throw std::invalid_argument(text.str());
}

void set_value(const EffectInfo& info, std::string_view name, std::string_view text,
               std::vector<double>* values) {
  const auto parameter = std::find_if(info.parameters.begin(), info.parameters.end(),
                                      [&](const Parameter& p) { return name == p.name; });
  if (parameter == info.parameters.end())
    refuse("The effect ", info.name, " has no parameter \"", name,
           "\": ", list_of_parameters(info));
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value) ||
      value < parameter->minimum || value > parameter->maximum ||
      (parameter->whole && value != std::floor(value)))
    refuse("\"", text, "\" is no value for ", info.name, "'s ", parameter->name, ": ",
           list_of_parameters(info));
  (*values)[static_cast<size_t>(parameter - info.parameters.begin())] = value;
}

NamedEffect parse_effect(const EffectInfo& info, std::string_view item) {
  NamedEffect effect{&info, {}};
  for (const Parameter& parameter : info.parameters) effect.values.push_back(parameter.standard);
  const auto parts = split(item, ':');
  for (size_t i = 0; i < parts.size(); ++i) {
    const auto equals = parts[i].find('=');
    if (equals == std::string_view::npos) {
      if (i == 0) continue;
      refuse("\"", parts[i], "\" in ", info.name, " has no value: ", list_of_parameters(info));
    }
    const std::string_view name = i == 0 ? std::string_view(info.parameters.front().name)
                                         : trimmed(parts[i].substr(0, equals));
    set_value(info, name, trimmed(parts[i].substr(equals + 1)), &effect.values);
  }
  return effect;
}

}  // namespace

std::span<const Preset> presets() { return kPresets; }

std::vector<NamedEffect> parse_scene(std::string_view text) {
  std::vector<NamedEffect> scene;
  const auto put = [&](NamedEffect effect) {
    const auto same = std::find_if(scene.begin(), scene.end(), [&](const NamedEffect& other) {
      return other.info == effect.info;
    });
    if (same != scene.end())
      *same = std::move(effect);
    else
      scene.push_back(std::move(effect));
  };
  if (trimmed(text).empty()) return scene;
  for (const std::string_view item : split(text, ',')) {
    const std::string_view name = trimmed(item.substr(0, item.find_first_of("=:")));
    const auto preset = std::find_if(presets().begin(), presets().end(),
                                     [&](const Preset& p) { return name == p.name; });
    if (preset != presets().end()) {
      if (name != item) refuse("The preset ", name, " takes no value. ", list_of_names());
      for (auto& effect : parse_scene(preset->effects)) put(std::move(effect));
      continue;
    }
    const auto info = std::find_if(effects().begin(), effects().end(),
                                   [&](const EffectInfo* e) { return name == e->name; });
    if (info == effects().end())
      refuse("There is no preset or effect \"", name, "\". ", list_of_names());
    put(parse_effect(**info, item));
  }
  const auto rank = [](const NamedEffect& effect) {
    return std::find(effects().begin(), effects().end(), effect.info);
  };
  std::sort(scene.begin(), scene.end(),
            [&](const NamedEffect& a, const NamedEffect& b) { return rank(a) < rank(b); });
  return scene;
}

}  // namespace qdmd::scene
