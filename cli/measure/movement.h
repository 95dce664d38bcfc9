// How many bodies a run has moved, and with which numbers: what tells a world at rest from one that is
// frozen.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/settings.h"

namespace tessera {

// A body has moved if it ends at least this far (m) from where it began.
inline constexpr double kMovedMin = 0.1;

struct MovementReport {
  std::size_t bodies = 0;      // dynamic ones that were told of
  std::size_t moved = 0;       // infinitely far for what is no number any longer
  double coordinate_max = 0;   // m, relative to the home; infinite likewise
  double coordinate_step = 0;  // m, between neighbouring numbers of the run's precision there
};

// Compares where bodies are with where they began.
class Movement {
 public:
  // `start` are the world's bodies as records_of() gives them: the first has the id 1, and so on.
  Movement(std::vector<BodyRecord> start, double sector_size, Precision precision)
      : start_(std::move(start)), sector_size_(sector_size), precision_(precision) {}

  // Tell of every body once; those that are not dynamic, or not of the start, are ignored.
  void set_end(const BodyRecord& record);

  MovementReport report() const;

 private:
  std::vector<BodyRecord> start_;
  double sector_size_;
  Precision precision_;
  MovementReport report_;
};

}  // namespace tessera
