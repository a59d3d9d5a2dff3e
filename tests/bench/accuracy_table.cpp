// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/bench/accuracy_table.h"

#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "tests/bench/clock.h"

namespace qdmd::bench {
namespace {

constexpr const char* kPointColumns =
    "part,scenes,name,method,solver,rank,step,window,iterations,width,height";
constexpr size_t kPointFields = 11;
// In the order of the file.
const std::vector<std::string> kValueColumns = {"turns",
                                                "ms",
                                                "ms_low",
                                                "ms_high",
                                                "clock_ms",
                                                "layout_mb",
                                                "peak_mb",
                                                "age",
                                                "age_worst",
                                                "psnr",
                                                "cqm",
                                                "moved",
                                                "condition",
                                                "movement",
                                                "sensitivity",
                                                "lambda_error",
                                                "background_error",
                                                "rank_found",
                                                "dropped",
                                                "budget_ms",
                                                "before_ms",
                                                "first_ms",
                                                "after_ms",
                                                "found_period",
                                                "found_step",
                                                "found_iterations",
                                                "changes"};

std::string head() {
  std::string text = kPointColumns;
  for (const auto& column : kValueColumns) text.append(1, ',').append(column);
  return text;
}

// A field of /proc/self/status, in MB; below 0: not there.
double status_megabytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(name + ":")) return std::stod(line.substr(name.size() + 1)) / 1024;
  return -1;
}

}  // namespace

std::string Point::text() const {
  std::string result = part + "," + scenes + "," + name + "," + method + "," + solver;
  for (int number : {rank, step, window, iterations, width, height})
    result.append(1, ',').append(std::to_string(number));
  return result;
}

Table::Table(const std::string& path) : path_(path) {
  const std::string first = head();
  const auto commas = std::count(first.begin(), first.end(), ',');
  std::vector<std::string> lines;
  if (std::ifstream old(path); old) {
    std::string line;
    if (std::getline(old, line) && line != first)
      throw std::runtime_error(path + " has other columns: move it away");
    while (std::getline(old, line)) {
      // Without its end, a last number may lack digits.
      if (old.eof() || std::count(line.begin(), line.end(), ',') != commas) continue;
      size_t end = 0;
      for (size_t field = 0; field < kPointFields; ++field) end = line.find(',', end) + 1;
      if (known_.insert(line.substr(0, end - 1)).second) lines.push_back(line);
    }
  }
  const std::string fresh = path + ".new";
  file_.open(fresh);
  file_ << first << '\n';
  for (const auto& line : lines) file_ << line << '\n';
  file_.flush();
  if (!file_) throw std::runtime_error("cannot write " + fresh);
  std::filesystem::rename(fresh, path);
}

void Table::add(const Point& point, const Values& values) {
  for (const auto& [name, value] : values)
    if (std::find(kValueColumns.begin(), kValueColumns.end(), name) == kValueColumns.end())
      throw std::logic_error("no column " + name);
  file_ << point.text();
  for (const auto& column : kValueColumns) {
    file_ << ',';
    const auto found = values.find(column);
    if (found == values.end()) continue;
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", found->second);
    file_ << text;
  }
  file_ << std::endl;
  if (!file_) throw std::runtime_error("cannot write " + path_);
  known_.insert(point.text());
  ++added_;
}

void Times::put(Values* values) const {
  (*values)["turns"] = static_cast<double>(processor.size());
  (*values)["ms"] = median(processor);
  (*values)["ms_low"] = quantile(processor, 0);
  (*values)["ms_high"] = quantile(processor, 1);
  (*values)["clock_ms"] = median(clock);
}

std::vector<Times> in_turn(const std::vector<Job>& jobs, int turns, double seconds) {
  std::vector<Times> times(jobs.size());
  std::vector<double> used(jobs.size(), 0);
  for (int turn = 0; turn < turns; ++turn)
    for (size_t j = 0; j < jobs.size(); ++j) {
      if (turn > 0 && used[j] > seconds) continue;
      const double start = cpu_seconds();
      const double took = seconds_of(jobs[j].work);
      const double processor = cpu_seconds() - start;
      used[j] += processor;
      times[j].processor.push_back(1e3 * processor / jobs[j].frames);
      times[j].clock.push_back(1e3 * took / jobs[j].frames);
    }
  return times;
}

double peak_megabytes(const std::function<void()>& work) {
  malloc_trim(0);
  const double before = status_megabytes("VmRSS");
  // 5: from now on the peak counts anew.
  const bool reset = static_cast<bool>(std::ofstream("/proc/self/clear_refs") << 5 << std::flush);
  work();
  const double peak = status_megabytes("VmHWM");
  return reset && before >= 0 ? std::max(0.0, peak - before) : 0;
}

}  // namespace qdmd::bench
