// SPDX-License-Identifier: LGPL-2.1-or-later
// Result rows and their tables.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "core/metrics/mask_scores.h"
#include "core/metrics/picture_scores.h"

namespace qdmd::evaluation {

struct Row {
  std::string sequence, method;
  std::optional<PictureScores> picture;        // none: the sequence has no true background
  std::optional<double> precision, recall, f;  // none: no masks on one side, or nothing to count
  uint64_t frames = 0;
  double seconds = 0;
};

enum class Format { text, csv, json };

// Columns: sequence method AGE pEPs pCEPs MSSSIM PSNR CQM precision recall F frames seconds.
// pEPs and pCEPs are shares, 0 to 1. What there is not is "-" in text, empty in CSV, null in JSON.
void write_table(const std::vector<Row>& rows, Format format, std::ostream& out);

nlohmann::ordered_json to_json(const Row& row);
// Throws nlohmann::json::exception where a column is missing or of another type.
Row row_from(const nlohmann::json& json);

}  // namespace qdmd::evaluation
