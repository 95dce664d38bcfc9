// What happens at seams, for those who watch. Between ticks.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"

namespace tessera {

// A copy of a body in the engine world of one of the partition's sectors.
struct CloneAt {
  BodyId body;
  WorldPosition position;  // of its centre of mass, in the sector that it visits
};

// Ascending by body and sector.
std::vector<CloneAt> clones_of(const Partition& partition);

// An awake island that reaches over borders, with those of its bodies that live here.
struct IslandHere {
  BodyId id;                   // the smallest of all its bodies
  std::vector<BodyId> bodies;  // ascending
};

// Ascending by id.
std::vector<IslandHere> islands_across_seams(const Partition& partition);

}  // namespace tessera
