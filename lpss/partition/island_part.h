// The part of an island that one sector, or one server, knows.
#pragma once

#include <cstdint>
#include <vector>

#include "lpss/grid/sector_index.h"
#include "lpss/model/body.h"

namespace tessera {

// Bodies that touch one another and are known in one place.
struct IslandPart {
  std::vector<BodyId> shared;  // with other parts, which may so belong to the same island
  BodyId first;                // the smallest of its own bodies, by which the part is known
  std::uint32_t bodies = 0;
  std::uint32_t contacts = 0;
  bool any_awake = false;
  bool all_want_sleep = true;  // every own body wants to sleep or sleeps
  // What its contacts ask of the solver; see ContactPair.
  std::uint32_t substeps = 0;
  bool bounces = false;
  // Only a single solver can solve it: joints hold its bodies, or a contact is between homes that are more
  // than one sector apart.
  bool is_indivisible = false;
};

// The parts of islands in one sector that reach over a border; replaces what was reported of the sector
// before.
struct SectorSeams {
  SectorIndex sector;
  std::vector<IslandPart> parts;
  bool is_news =
      true;  // found in this tick; otherwise, the sector is at rest, and its parts are as they were
};

}  // namespace tessera
