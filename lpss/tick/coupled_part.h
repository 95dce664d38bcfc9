// A part of an island that is beyond the cap, while it is solved beside the others (engine.h, PartSolver).
#pragma once

#include <memory>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/grid/sector_map.h"
#include "lpss/tick/island_assembly.h"

namespace tessera {

struct CoupledPart {
  struct Shared {
    BodyId id;
    std::size_t place = 0;    // in the task's bodies
    std::uint64_t ranks = 0;  // bits: which servers have a copy, or the body
  };

  BodyId name;  // the first of its bodies
  Sector* sector = nullptr;
  std::uint32_t component = 0;          // of the sector
  std::vector<Shared> shared;           // ascending by id
  std::unique_ptr<SectorWorld> copies;  // bodies that only joints reach to
  SolveJob job;
  std::unique_ptr<PartSolver> solver;
};

}  // namespace tessera
