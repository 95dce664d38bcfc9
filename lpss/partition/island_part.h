// The part of an island that one sector, or one server, knows.
#pragma once

#include <cstdint>
#include <vector>

#include "lpss/model/body.h"

namespace tessera {

// Bodies that touch one another and are known in one place.
struct IslandPart {
  std::vector<BodyId> links;  // bodies by which other parts may belong to the same island
  BodyId first;               // the smallest id of its own bodies: the part's name
  std::uint32_t bodies = 0;   // own dynamic bodies
  std::uint32_t contacts = 0;
  bool any_awake = false;
  bool all_drowsy = true;  // every own body is ready to sleep or asleep
};

}  // namespace tessera
