// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/job_folder.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace qdmd::archive {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

constexpr const char* kPlan = "plan.json";
constexpr const char* kLock = "lock";

}  // namespace

JobFolder::JobFolder(const std::string& first_result) : path_(first_result + ".progress") {}

std::string JobFolder::file(const char* name) const { return (fs::path(path_) / name).string(); }

std::string JobFolder::of_stretch(size_t index, const char* kind) const {
  char name[32];
  std::snprintf(name, sizeof name, "%08zu.%s", index + 1, kind);
  return file(name);
}

std::optional<Plan> JobFolder::read_plan() const {
  const auto text = read_file(file(kPlan));
  if (!text) return std::nullopt;
  try {
    return plan_of(*text);
  } catch (const std::exception&) {
    throw std::runtime_error(file(kPlan) +
                             " is no plan of qdmd-archive: remove its folder to begin anew");
  }
}

void JobFolder::write_plan(const Plan& plan) const { write_file(file(kPlan), text_of(plan)); }

LockedFile JobFolder::hold() const {
  const fs::path beside = fs::absolute(path_).parent_path();
  if (!fs::is_directory(beside))
    throw std::runtime_error(beside.string() + " is no folder: make it first");
  fs::remove_all(temporary_of(path_));
  fs::create_directories(path_);
  return LockedFile::wait_for(file(kLock));
}

std::optional<LockedFile> JobFolder::hold_to_join() const { return LockedFile::take(file(kLock)); }

std::optional<LockedFile> JobFolder::take(size_t index) const {
  return LockedFile::take(of_stretch(index, "work"));
}

std::optional<StretchFacts> JobFolder::facts(size_t index) {
  known_.resize(std::max(known_.size(), index + 1));
  std::optional<StretchFacts>& known = known_[index];
  if (known) return known;
  const auto text = read_file(of_stretch(index, "done"));
  if (!text) return std::nullopt;
  const Json json = Json::parse(*text);
  known = {json.at("frames"), json.at("warm-up"), json.at("seconds"), json.at("processor-seconds"),
           json.at("most-memory")};
  return known;
}

void JobFolder::finish(size_t index, const StretchFacts& facts) {
  write_file(of_stretch(index, "done"), Json{{"frames", facts.frames},
                                             {"warm-up", facts.warm_up},
                                             {"seconds", facts.seconds},
                                             {"processor-seconds", facts.processor_seconds},
                                             {"most-memory", facts.most_memory}}
                                                .dump() +
                                            "\n");
}

int64_t JobFolder::frames_done(size_t stretches) {
  int64_t frames = 0;
  for (size_t i = 0; i < stretches; ++i) {
    if (const auto whole = facts(i))
      frames += whole->frames;
    else if (const auto under_way = read_file(of_stretch(i, "work")))
      frames += std::atoll(under_way->c_str());
  }
  return frames;
}

void JobFolder::clear() {
  fs::remove(file(kPlan));
  for (const auto& entry : fs::directory_iterator(path_))
    if (entry.path().filename() != kLock) fs::remove_all(entry.path());
  known_.clear();
}

void JobFolder::remove() const {
  // At once: who still looks finds all of it, or nothing.
  const std::string going = temporary_of(path_);
  fs::rename(path_, going);
  fs::remove_all(going);
}

}  // namespace qdmd::archive
