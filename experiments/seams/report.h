// The results as JSON and CSV.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "experiments/seams/battery.h"
#include "experiments/seams/costs.h"

namespace tessera::seams {

// {"engine", "rows", "noise", "costs", "equal_hashes"}. What was not measured is null.
nlohmann::json to_json(const Results& results, const Costs& costs, Precision precision);

// The rows as CSV with a header line, with the noise of their scene; for gnuplot.
std::string to_csv(const Results& results, Precision precision);
std::string to_csv(const Costs& costs);

// The rows of policy `island` that miss their requirements, each with its reasons.
std::vector<std::string> misses(const Results& results, Precision precision);

}  // namespace tessera::seams
