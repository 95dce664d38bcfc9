// Where in a world there is something to see: clusters of sectors with bodies that can move.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "tessera/client.h"

namespace tessera::viewer {

struct Place {
  WorldPosition centre;  // of its bodies
  double half = 0;       // m: no body is farther from the centre along an axis
  std::uint64_t bodies = 0;
  std::uint64_t sectors = 0;
  BodyId first;  // of its bodies, by id
};

// Sectors with bodies that touch, also at a corner, are one place. Those with the most bodies first.
std::vector<Place> places_of(const std::vector<BodySample>& bodies, double sector_size);

}  // namespace tessera::viewer
