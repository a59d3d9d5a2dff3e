// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes as text: what is read, and what errors say.
#include "core/scene/description.h"

#include <set>
#include <sstream>
#include <stdexcept>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::EffectInfo;
using scene::NamedEffect;
using scene::parse_scene;

const EffectInfo* info_of(const std::string& name) {
  for (const EffectInfo* info : scene::effects())
    if (info->name == name) return info;
  return nullptr;
}

// Names and values, as "noise(2,0.5,0) jitter(1.5,3) ".
std::string read(std::string_view text) {
  std::ostringstream out;
  for (const NamedEffect& effect : parse_scene(text)) {
    out << effect.info->name;
    char separator = '(';
    for (const double value : effect.values) {
      out << separator << value;
      separator = ',';
    }
    out << ") ";
  }
  return out.str();
}

std::string refusal(std::string_view text) {
  try {
    parse_scene(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  ADD_FAILURE() << "accepted: " << text;
  return {};
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// ---- The lists ----

TEST(SceneDescription, EveryEffectIsDescribed) {
  std::set<std::string> names;
  for (const EffectInfo* info : scene::effects()) {
    EXPECT_TRUE(names.insert(info->name).second) << info->name;
    EXPECT_GT(std::string(info->description).size(), 20u) << info->name;
    ASSERT_FALSE(info->parameters.empty()) << info->name;
    std::set<std::string> parameters;
    for (const auto& parameter : info->parameters) {
      EXPECT_TRUE(parameters.insert(parameter.name).second) << info->name;
      EXPECT_LT(parameter.minimum, parameter.maximum) << info->name << ' ' << parameter.name;
      EXPECT_LE(parameter.minimum, parameter.standard) << info->name << ' ' << parameter.name;
      EXPECT_LE(parameter.standard, parameter.maximum) << info->name << ' ' << parameter.name;
      EXPECT_TRUE(parameter.unit && parameter.description && *parameter.description);
    }
  }
  for (const auto& preset : scene::presets()) {
    EXPECT_TRUE(names.insert(preset.name).second) << preset.name;
    EXPECT_GT(std::string(preset.intent).size(), 20u) << preset.name;
    EXPECT_NO_THROW(parse_scene(preset.effects)) << preset.name;
  }
}

TEST(SceneDescription, EveryCategoryOfSBMnetIsAPreset) {
  for (const char* name : {"basic", "intermittent-motion", "clutter", "jitter",
                           "illumination-changes", "background-motion", "very-long", "very-short"})
    EXPECT_FALSE(parse_scene(name).empty()) << name;
  EXPECT_TRUE(parse_scene("default").empty());
}

// PTZ, thermal and turbulence are not simulated.
TEST(SceneDescription, EightCategoriesOfCDnetArePresets) {
  for (const char* name :
       {"baseline", "bad-weather", "camera-jitter", "dynamic-background",
        "intermittent-object-motion", "low-framerate", "night-videos", "hard-shadows"})
    EXPECT_FALSE(parse_scene(name).empty()) << name;
}

// ---- Reading ----

TEST(SceneDescription, EveryEffectAloneHasItsStandardValues) {
  for (const EffectInfo* info : scene::effects()) {
    const auto scene = parse_scene(info->name);
    ASSERT_EQ(scene.size(), 1u) << info->name;
    EXPECT_EQ(scene[0].info, info);
    ASSERT_EQ(scene[0].values.size(), info->parameters.size());
    for (size_t i = 0; i < scene[0].values.size(); ++i)
      EXPECT_EQ(scene[0].values[i], info->parameters[i].standard) << info->name;
  }
}

TEST(SceneDescription, EveryParameterIsSetByItsName) {
  for (const EffectInfo* info : scene::effects())
    for (size_t i = 0; i < info->parameters.size(); ++i)
      for (const double value : {info->parameters[i].minimum, info->parameters[i].maximum}) {
        std::ostringstream text;
        text << info->name << ':' << info->parameters[i].name << '=' << value;
        const auto scene = parse_scene(text.str());
        ASSERT_EQ(scene.size(), 1u) << text.str();
        for (size_t k = 0; k < scene[0].values.size(); ++k)
          EXPECT_EQ(scene[0].values[k], k == i ? value : info->parameters[k].standard)
              << text.str();
      }
}

TEST(SceneDescription, TheFirstValueNeedsNoName) {
  EXPECT_EQ(read("noise=3"), "noise(3,0.5,0) ");
  EXPECT_EQ(read("noise=3:gain=12"), "noise(3,0.5,12) ");
  EXPECT_EQ(read("noise:gain=12:shot=1"), "noise(2,1,12) ");
  EXPECT_EQ(read("noise:deviation=4"), "noise(4,0.5,0) ");
  EXPECT_EQ(read("fade=-1"), "fade(-1,8,0) ");
  EXPECT_EQ(read("fade=0.5:duration=1e6"), "fade(0.5,1e+06,0) ");
}

TEST(SceneDescription, NothingIsTheDefaultScene) {
  for (const char* text : {"", " ", "\t \n", "default", " default ", "default,default"})
    EXPECT_EQ(read(text), "") << '"' << text << '"';
}

TEST(SceneDescription, PresetsAndEffectsMix) {
  EXPECT_EQ(read("basic"), "noise(2,0.5,0) ");
  EXPECT_EQ(read("basic,stop=3"), "stop(3) noise(2,0.5,0) ");
  EXPECT_EQ(read("default,rain"), read("rain"));
  EXPECT_EQ(read("very-short"), "low-rate(2) length(10) noise(2,0.5,0) ");
  EXPECT_EQ(read("very-long"), "length(20000) fade(0.5,600,0) noise(2,0.5,0) ");
  EXPECT_EQ(parse_scene("storm,illumination-changes").size(), 9u);
}

TEST(SceneDescription, TheOrderOfTheTextDoesNotCount) {
  EXPECT_EQ(read("noise=3,jitter=1,fade"), read("fade,noise=3,jitter=1"));
  std::string all, reversed;
  for (const auto& name : effect_names()) {
    all += (all.empty() ? "" : ",") + name;
    reversed = name + (reversed.empty() ? "" : ",") + reversed;
  }
  EXPECT_EQ(read(all), read(reversed));
  const auto scene = parse_scene(reversed);
  ASSERT_EQ(scene.size(), scene::effects().size());
  for (size_t i = 0; i < scene.size(); ++i) EXPECT_EQ(scene[i].info, scene::effects()[i]);
}

TEST(SceneDescription, TheLaterHolds) {
  EXPECT_EQ(read("noise=3,noise=4"), "noise(4,0.5,0) ");
  EXPECT_EQ(read("noise=3:gain=6,noise:shot=1"), "noise(2,1,0) ");
  EXPECT_EQ(read("noise=3:deviation=5"), "noise(5,0.5,0) ");
  EXPECT_EQ(read("noise:gain=6:gain=7"), "noise(2,0.5,7) ");
  EXPECT_EQ(read("noise=9,basic"), "noise(2,0.5,0) ");
  EXPECT_EQ(read("basic,noise=9"), "noise(9,0.5,0) ");
}

TEST(SceneDescription, SpacesDoNotCount) {
  EXPECT_EQ(read(" noise = 3 : gain = 12 ,\n\tjitter = 1 "), read("noise=3:gain=12,jitter=1"));
  EXPECT_EQ(read("\tvery-short , rain"), read("very-short,rain"));
}

// ---- Errors ----

TEST(SceneDescription, AWrongNameListsThem) {
  for (const char* text : {"nois", "Noise", "noise jitter", "3", "=3", ":gain=3", "noise,,jitter",
                           "noise,", ",", "jitter;noise", "de fault", "basic=3", "no ise=2"}) {
    const std::string message = refusal(text);
    for (const auto& name : scene_names())
      EXPECT_TRUE(has(message, ' ' + name)) << text << ": " << message;
  }
  EXPECT_TRUE(has(refusal("noise,nois=3"), "\"nois\""));
}

TEST(SceneDescription, AWrongParameterListsThem) {
  for (const char* part : {"", "gai=3", "Gain=3", "=3", "gain", "=", "3"}) {
    const std::string message = refusal("jitter,noise=2:" + std::string(part));
    EXPECT_TRUE(has(message, "deviation from 0 to 60 levels")) << message;
    EXPECT_TRUE(has(message, "shot from 0 to 1 of the variance")) << message;
    EXPECT_TRUE(has(message, "gain from 0 to 40 dB")) << message;
    EXPECT_TRUE(has(message, "noise=2:shot=0.5")) << message;
  }
}

TEST(SceneDescription, WhatIsNoNumberIsRefused) {
  for (const char* value : {"", " ", "nan", "NaN", "-nan", "nan(1)", "inf", "-inf", "infinity", "x",
                            "2x", "2 3", "0x10", "1e", "1e400", "--1", "2=3", "1e-400000"})
    for (const char* name : {"noise=", "noise:gain=", "noise=2:gain="}) {
      const std::string message = refusal(std::string(name) + value);
      EXPECT_TRUE(has(message, "gain from 0 to 40 dB")) << message;
    }
}

TEST(SceneDescription, ValuesOutOfRangeAreRefused) {
  for (const EffectInfo* info : scene::effects())
    for (const auto& parameter : info->parameters) {
      const double span = parameter.maximum - parameter.minimum;
      for (const double value :
           {parameter.minimum - span / 1000, parameter.maximum + span / 1000, -1e300, 1e300}) {
        std::ostringstream text;
        text.precision(17);
        text << info->name << ':' << parameter.name << '=' << value;
        const std::string message = refusal(text.str());
        std::ostringstream range;
        range << parameter.name << " from " << parameter.minimum << " to " << parameter.maximum;
        EXPECT_TRUE(has(message, range.str())) << message;
        EXPECT_TRUE(has(message, std::string(info->name) + "'s " + parameter.name)) << message;
      }
    }
  EXPECT_TRUE(has(refusal("length=1e300"), "frames from 1 to 1e+09"));
  EXPECT_TRUE(has(refusal("length=0"), "frames from 1 to 1e+09"));
}

TEST(SceneDescription, AnErrorAnywhereIsFound) {
  EXPECT_TRUE(has(refusal("basic,jitter=1,rain:colour=3"), "rain"));
  EXPECT_TRUE(has(refusal("storm,fade=2"), "fade"));
  EXPECT_THROW(scene::Scene(options(4, 3), "nothing"), std::invalid_argument);
}

TEST(SceneDescription, ListsOfErrorsCanBeReadAgain) {
  // The example in each message is a scene.
  for (const EffectInfo* info : scene::effects()) {
    const std::string message = refusal(std::string(info->name) + "=nan");
    const auto begin = message.rfind("as in ") + 6;
    const std::string example = message.substr(begin, message.size() - 1 - begin);
    EXPECT_EQ(read(example), read(info->name)) << message;
  }
  EXPECT_NO_THROW(parse_scene("noise=3,jitter=1.5"));
  EXPECT_EQ(info_of("noise")->parameters[0].name, std::string("deviation"));
}

// Half a frame, half a person and half a percent of quality are cut off without a word.
TEST(SceneDescription, CountsAreWhole) {
  for (const char* text : {"length=1.5", "bootstrap=2.5"}) refusal(text);
}

}  // namespace
}  // namespace qdmd::test
