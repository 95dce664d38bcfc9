// The distances between the bodies of two runs, in two figures.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/measure/report.h"
#include "cli/measure/stopwatch.h"
#include "cli/tune/trial.h"

namespace tessera {

// The distance of each body from its position in another run, m.
inline std::vector<double> distances(const Positions& a, const Positions& b) {
  std::vector<double> all;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) all.push_back((a[i] - b[i]).norm());
  return all;
}

// Null if there are no distances, or one is not a number.
struct Spread {
  explicit Spread(const std::vector<double>& all) {
    if (all.empty() || !std::ranges::all_of(all, [](double d) { return std::isfinite(d); })) return;
    middle = median(all);
    largest = *std::ranges::max_element(all);
  }
  Row middle;
  Row largest;
};

}  // namespace tessera
