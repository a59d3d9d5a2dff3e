// SPDX-License-Identifier: LGPL-2.1-or-later
// Every sequence by every method, several at a time.
#pragma once

#include "tests/evaluation/clip.h"
#include "tests/evaluation/method.h"
#include "tests/evaluation/progress.h"
#include "tests/evaluation/store.h"

namespace qdmd::evaluation {

struct Plan {
  std::vector<Sequence> sequences;
  Methods methods;
  Selection selection;
  ScoredPicture picture = ScoredPicture::middle;
  unsigned jobs = 1;                 // at a time
  std::filesystem::path output_dir;  // of pictures; empty: none are written
  Store store;
  std::string settings;  // what else the results depend on
};

// Rows in the order of sequences, then of methods; what failed has none and was told to
// `progress`. Writes <sequence>_<method>.png and <sequence>_sheet.png ("/" in a name becomes "_").
std::vector<Row> run(const Plan& plan, Progress& progress);

}  // namespace qdmd::evaluation
