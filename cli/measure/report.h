// What an experiment found out, as data: tables of named cells that become JSON, CSV, text or a picture.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tessera {

// An object of names and plain values; what was not measured, or is no number, is null.
using Row = nlohmann::ordered_json;

struct Table {
  std::string name;  // "rows" for the main one
  std::vector<Row> rows;
};

struct Report {
  std::vector<Table> tables;
  std::vector<std::string> misses;  // what was asked for and is not so, with its figure

  // The table of that name, made where there is none yet.
  std::vector<Row>& table(const std::string& name);

  // Adds the rows of the tables of the same names.
  void append(Report other);

  // The number of rows of all tables.
  std::size_t rows() const;
};

// {"rows": [...], another table's name: [...], ..., "misses": [...]}.
nlohmann::ordered_json to_json(const Report& report);
// INVALID_ARGUMENT for what to_json() does not make.
absl::StatusOr<Report> report_from_json(const nlohmann::ordered_json& json);

// A line of names, then a line a row. Names are those of all rows, in the order in which they come first.
std::vector<std::vector<std::string>> to_cells(const std::vector<Row>& rows, int digits);
std::string to_csv(const std::vector<Row>& rows);

// Hears how much of the work is done and what it has found until then, and may end it: false.
using Progress = std::function<bool(std::uint64_t done, std::uint64_t total, const Report& so_far)>;

// Counts work towards a total that is known beforehand.
class ProgressCount {
 public:
  // `progress` must outlive this, and `report`, in which the work collects what it finds, all calls. More
  // work may become known before the first piece is done.
  ProgressCount(const Progress& progress, std::uint64_t total, const Report& report = kNoReport)
      : progress_(progress), total_(total), report_(report) {}
  void expect(std::uint64_t more) { total_ += more; }

  // One more piece is done. CANCELLED where the work is to end.
  absl::Status advance();

  // Pieces that were done in another process, which has counted them for itself.
  void skip(std::uint64_t pieces) { done_ += pieces; }

 private:
  static const Report kNoReport;

  const Progress& progress_;
  std::uint64_t total_;
  const Report& report_;
  std::uint64_t done_ = 0;
};

}  // namespace tessera
