// SPDX-License-Identifier: LGPL-2.1-or-later
// The points that accuracy-cost measures, as a CSV file that a later run continues.
#pragma once

#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace qdmd::bench {

// What is measured. Texts have no commas and no quotes.
struct Point {
  std::string part;    // quality, error, scaling, budget
  std::string scenes;  // in which family of cases
  std::string name;    // the case
  std::string method, solver;
  int rank = 0, step = 0, window = 0, iterations = 1;
  int width = 0, height = 0;

  std::string text() const;
};

// What came out, by the name of the column. Columns that are left out stay empty.
using Values = std::map<std::string, double>;

class Table {
 public:
  // Reads what an earlier run wrote to `path`; a line that was cut off counts for nothing. Throws
  // std::runtime_error where the file is another one's.
  explicit Table(const std::string& path);

  bool has(const Point& point) const { return known_.contains(point.text()); }
  // On the disk when it returns. Throws std::runtime_error where that cannot be.
  void add(const Point& point, const Values& values);
  size_t added() const { return added_; }

 private:
  std::string path_;
  std::set<std::string> known_;
  std::ofstream file_;
  size_t added_ = 0;
};

// Repeats of one thing, in milliseconds.
struct Times {
  std::vector<double> processor, clock;

  // ms (the median), ms_low and ms_high (the least and the largest), clock_ms, turns.
  void put(Values* values) const;
};

// A job returns nothing and is timed as a whole; `frames` divides its time.
struct Job {
  std::function<void()> work;
  double frames = 1;
};

// In each turn every job runs once, so that whatever else the machine does hits all alike. A job
// that has used up `seconds` of processor time takes part no more.
std::vector<Times> in_turn(const std::vector<Job>& jobs, int turns, double seconds);

// What the program does between two signs of progress.
struct Step {
  std::string what;
  std::function<void()> work;
};
using Steps = std::vector<Step>;

// The most memory that `work` has in addition to what there is before it, in MB; 0 where the system
// does not say.
double peak_megabytes(const std::function<void()>& work);

}  // namespace qdmd::bench
