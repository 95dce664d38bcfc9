// Programs of a world, as data: what acts inside the tick (lpss/programs/program.h says what they do).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "lpss/grid/sector_index.h"

namespace tessera {

// One instance of a program, attached to a body that can move. It lives where its body lives.
struct ProgramRecord {
  std::string kind;                // which program, such as "character"
  std::vector<double> parameters;  // what its user chose; in the order of the program's table, as all numbers
  std::vector<double> inputs;      // what it was last told
  std::vector<double> values;      // its state, which is what it publishes, too
  // A tick at whose end it runs even if its body sleeps; 0: none.
  std::uint64_t wake_at = 0;
  // Where its body's centre of mass was when it was attached: a sector, and m from its centre.
  SectorIndex start_sector;
  std::array<double, 3> start{};
  std::string fault;  // why it was stopped; empty: it runs
};

}  // namespace tessera
