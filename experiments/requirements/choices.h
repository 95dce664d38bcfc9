// Work that is skipped when nothing in a world requires it, and the same world with that work.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"

namespace tessera {

// An automatic choice for every body, island or sector. Without it, all other choices are still made.
struct Choice {
  std::string name;
  bool free_flight = true;                          // as in PartitionOptions, for the run without the choice
  std::function<void(WorldDescription&)> unmake{};  // other changes to the world without it; empty: none
};

// The choices that apply to this world:
//   "sleep"     bodies at rest sleep; without it none sleeps
//   "coast"     a body in free flight needs no solver
//   "adapt"     as many substeps as an island needs; without it, the number in the settings for all
//   "sweep"     bodies that are fast for their size are swept; without it none is: a cost, not a saving
// and if no body is static:
//   "no-search" a body alone in its sector has no pair search; without it, it is not alone
//               (add_pebbles())
//   "no-world"  a sector without a body that can move has no engine world; without it all have one
//               (add_keepers())
std::vector<Choice> choices_for(const WorldDescription& world);

// Adds a static pebble, which collides with nothing, at the centre of every sector with a body.
void add_pebbles(WorldDescription& world);

// Adds a kinematic pebble, which collides with nothing, at the centre of every sector without a body in the
// bounding box of all bodies.
void add_keepers(WorldDescription& world);

// `count` balls and bricks in a lattice with a spacing larger than a default sector, so that no two share
// one. They drift and tumble without gravity.
WorldDescription sparse_world(const WorldSettings& settings, int count);

// The same world with every dynamic body displaced by `distance` (m) along x, in alternating directions.
// Errors as canonical().
absl::Status disturb(WorldDescription& world, double distance);

}  // namespace tessera
