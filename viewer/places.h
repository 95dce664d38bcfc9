// Places of interest in a world: clusters of sectors with movable bodies.
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

// Adjacent sectors with bodies, also at a corner, form one place. Places with the most bodies come first.
std::vector<Place> places_of(const std::vector<BodySample>& bodies, double sector_size);

}  // namespace tessera::viewer
