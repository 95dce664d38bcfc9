#include "cli/measure/report.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera {
namespace {

constexpr char kMisses[] = "misses";

std::vector<std::string> names_in(const std::vector<Row>& rows) {
  std::vector<std::string> names;
  for (const Row& row : rows) {
    for (const auto& [name, value] : row.items()) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

std::string to_cell(const Row& row, const std::string& name, int digits) {
  const auto found = row.find(name);
  if (found == row.end() || found->is_null()) return "";
  if (found->is_string()) return found->get<std::string>();
  if (found->is_boolean()) return found->get<bool>() ? "1" : "0";
  if (!found->is_number_float()) return found->dump();
  const double value = found->get<double>();
  return std::isfinite(value) ? absl::StrFormat("%.*g", digits, value) : "";
}

// As RFC 4180 has it.
std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\n") == std::string::npos) return cell;
  return absl::StrCat("\"", absl::StrReplaceAll(cell, {{"\"", "\"\""}}), "\"");
}

}  // namespace

std::vector<Row>& Report::table(const std::string& name) {
  const auto found =
      std::find_if(tables.begin(), tables.end(), [&](const Table& t) { return t.name == name; });
  if (found != tables.end()) return found->rows;
  return tables.emplace_back(Table{name, {}}).rows;
}

void Report::append(Report other) {
  for (Table& more : other.tables) {
    std::vector<Row>& rows = table(more.name);
    std::move(more.rows.begin(), more.rows.end(), std::back_inserter(rows));
  }
  std::move(other.misses.begin(), other.misses.end(), std::back_inserter(misses));
}

std::size_t Report::rows() const {
  std::size_t sum = 0;
  for (const Table& table : tables) sum += table.rows.size();
  return sum;
}

nlohmann::ordered_json to_json(const Report& report) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const Table& table : report.tables) json[table.name] = table.rows;
  json[kMisses] = report.misses;
  return json;
}

absl::StatusOr<Report> report_from_json(const nlohmann::ordered_json& json) {
  Report report;
  if (!json.is_object()) return absl::InvalidArgumentError("a report must be an object");
  for (const auto& [name, rows] : json.items()) {
    if (!rows.is_array()) return absl::InvalidArgumentError(absl::StrCat("\"", name, "\" is not a list"));
    for (const auto& row : rows) {
      const bool fits = name == kMisses ? row.is_string() : row.is_object();
      if (!fits) return absl::InvalidArgumentError(absl::StrCat("\"", name, "\" has an invalid entry"));
    }
    if (name == kMisses) {
      report.misses = rows.get<std::vector<std::string>>();
    } else {
      report.table(name) = rows.get<std::vector<Row>>();
    }
  }
  return report;
}

std::vector<std::vector<std::string>> to_cells(const std::vector<Row>& rows, int digits) {
  const std::vector<std::string> names = names_in(rows);
  std::vector<std::vector<std::string>> lines = {names};
  for (const Row& row : rows) {
    std::vector<std::string> line;
    for (const std::string& name : names) line.push_back(to_cell(row, name, digits));
    lines.push_back(std::move(line));
  }
  return lines;
}

std::string to_csv(const std::vector<Row>& rows) {
  constexpr int kDigits = 9;
  std::string text;
  for (const std::vector<std::string>& line : to_cells(rows, kDigits)) {
    const auto append = [](std::string* out, const std::string& cell) { *out += quoted(cell); };
    absl::StrAppend(&text, absl::StrJoin(line, ",", append), "\n");
  }
  return text;
}

const Report ProgressCount::kNoReport;

absl::Status ProgressCount::advance() {
  return progress_(++done_, total_, report_) ? absl::OkStatus() : absl::CancelledError("interrupted");
}

}  // namespace tessera
