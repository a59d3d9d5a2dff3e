// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/report.h"

#include <algorithm>
#include <cstdio>

namespace qdmd::evaluation {

namespace {

using Number = std::optional<double>;

struct Column {
  const char* name;
  int decimals;
  Number (*value)(const Row&);
};

template <double PictureScores::*member>
Number picture(const Row& row) {
  if (!row.picture) return std::nullopt;
  return *row.picture.*member;
}
template <Number Row::*member>
Number mask(const Row& row) {
  return row.*member;
}

constexpr Column kColumns[] = {
    {"AGE", 4, picture<&PictureScores::age>},
    {"pEPs", 4, picture<&PictureScores::peps>},
    {"pCEPs", 4, picture<&PictureScores::pceps>},
    {"MSSSIM", 4, picture<&PictureScores::msssim>},
    {"PSNR", 4, picture<&PictureScores::psnr>},
    {"CQM", 4, picture<&PictureScores::cqm>},
    {"precision", 4, mask<&Row::precision>},
    {"recall", 4, mask<&Row::recall>},
    {"F", 4, mask<&Row::f>},
    {"frames", 0, [](const Row& row) -> Number { return static_cast<double>(row.frames); }},
    {"seconds", 3, [](const Row& row) -> Number { return row.seconds; }}};

std::string text_of(const Number& number, int decimals, const char* none) {
  if (!number) return none;
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, *number);
  return text;
}

// Quoted where a comma, a quote or a line break is in it (RFC 4180).
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::vector<std::vector<std::string>> cells_of(const std::vector<Row>& rows, const char* none) {
  std::vector<std::vector<std::string>> cells{{"sequence", "method"}};
  for (const Column& column : kColumns) cells[0].push_back(column.name);
  for (const Row& row : rows) {
    cells.push_back({row.sequence, row.method});
    for (const Column& column : kColumns)
      cells.back().push_back(text_of(column.value(row), column.decimals, none));
  }
  return cells;
}

void write_text(const std::vector<Row>& rows, std::ostream& out) {
  const auto cells = cells_of(rows, "-");
  std::vector<size_t> widths(cells[0].size());
  for (const auto& line : cells)
    for (size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], line[i].size());
  for (const auto& line : cells) {
    for (size_t i = 0; i < line.size(); ++i) {
      const std::string gap(widths[i] - line[i].size(), ' ');
      // Names to the left, numbers to the right.
      out << (i < 2 ? line[i] + gap : gap + line[i]) << (i + 1 < line.size() ? "  " : "\n");
    }
  }
}

void write_csv(const std::vector<Row>& rows, std::ostream& out) {
  for (const auto& line : cells_of(rows, ""))
    for (size_t i = 0; i < line.size(); ++i)
      out << csv_field(line[i]) << (i + 1 < line.size() ? "," : "\n");
}

Number number_from(const nlohmann::json& json, const char* name) {
  const auto& value = json.at(name);
  if (value.is_null()) return std::nullopt;
  return value.get<double>();
}

}  // namespace

void write_table(const std::vector<Row>& rows, Format format, std::ostream& out) {
  switch (format) {
    case Format::text:
      write_text(rows, out);
      break;
    case Format::csv:
      write_csv(rows, out);
      break;
    case Format::json: {
      auto table = nlohmann::ordered_json::array();
      for (const Row& row : rows) table.push_back(to_json(row));
      // A file name need not be UTF-8.
      out << table.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
      break;
    }
  }
}

nlohmann::ordered_json to_json(const Row& row) {
  nlohmann::ordered_json json{{"sequence", row.sequence}, {"method", row.method}};
  for (const Column& column : kColumns) {
    const Number number = column.value(row);
    json[column.name] = number ? nlohmann::ordered_json(*number) : nlohmann::ordered_json(nullptr);
  }
  json["frames"] = row.frames;
  return json;
}

Row row_from(const nlohmann::json& json) {
  Row row;
  row.sequence = json.at("sequence").get<std::string>();
  row.method = json.at("method").get<std::string>();
  if (!json.at("AGE").is_null()) {
    PictureScores& scores = row.picture.emplace();
    scores.age = json.at("AGE").get<double>();
    scores.peps = json.at("pEPs").get<double>();
    scores.pceps = json.at("pCEPs").get<double>();
    scores.msssim = json.at("MSSSIM").get<double>();
    scores.psnr = json.at("PSNR").get<double>();
    scores.cqm = json.at("CQM").get<double>();
  }
  row.precision = number_from(json, "precision");
  row.recall = number_from(json, "recall");
  row.f = number_from(json, "F");
  row.frames = json.at("frames").get<uint64_t>();
  row.seconds = json.at("seconds").get<double>();
  return row;
}

}  // namespace qdmd::evaluation
