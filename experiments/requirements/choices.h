// Work that is skipped where nothing in a world requires it, and the same world with that work.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"

namespace tessera {

// An automatic choice for every body, island or sector. Without it, all other choices are still made.
struct Choice {
  std::string name;
  bool free_flight = true;  // as in PartitionOptions, without the choice
  std::function<void(WorldDescription&)>
      unmake{};  // how else the world differs without it; empty: not at all
};

// The choices that matter in this world:
//   "sleep"     bodies at rest sleep; without it none does
//   "coast"     a body in free flight needs no solver
//   "adapt"     as many substeps as an island needs; without it, those of the settings for all
//   "sweep"     bodies that are fast for their size are swept; without it none is: a cost, not a saving
// and where no body is static:
//   "no-search" a body alone in its sector has no pair search; without it, it is not alone
//               (add_pebbles())
//   "no-world"  a sector without a body that can move has no engine world; without it all have one
//               (add_keepers())
std::vector<Choice> choices_for(const WorldDescription& world);

// Adds a static pebble, which collides with nothing, in the middle of every sector where a body is.
void add_pebbles(WorldDescription& world);

// Likewise a kinematic pebble, which collides with nothing, in the middle of every sector where no body is,
// of all that are between the outermost bodies along each axis.
void add_keepers(WorldDescription& world);

// `count` balls and bricks in a lattice that is wider than sectors of the default size, so that no two share
// one. They drift and tumble, without gravity.
WorldDescription sparse_world(const WorldSettings& settings, int count);

// The same world with every body that moves displaced by `distance` (m) along x, every other one to the other
// side. Errors as canonical().
absl::Status disturb(WorldDescription& world, double distance);

}  // namespace tessera
