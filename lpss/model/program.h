// Programs of a world, as data: what acts inside the tick (lpss/programs/program.h says what they do).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lpss/grid/sector_index.h"

namespace tessera {

// A kind of program that somebody wrote, as a WebAssembly module, for a world. lpss/programs/module.h makes
// them.
struct ProgramModule {
  std::string kind;   // of its records: its name and a checksum of its bytes, "flee@0123456789abcdef"
  std::string bytes;  // as it was compiled
};
using ProgramModules = std::vector<std::shared_ptr<const ProgramModule>>;

// One instance of a program, attached to a body that can move. It lives where its body lives.
struct ProgramRecord {
  std::string kind;                // which program: "character", or that of a module of the world
  std::vector<double> parameters;  // what its user chose; in the order of the program's table, as all numbers
  std::vector<double> inputs;      // what it was last told
  std::vector<double> values;      // its state, which is what it publishes, too
  // A tick at whose end it runs even if its body sleeps; 0: none.
  std::uint64_t wake_at = 0;
  // Where its body's centre of mass was when it was attached: a sector, and m from its centre.
  SectorIndex start_sector;
  std::array<double, 3> start{};
  std::string fault;  // why it was stopped; empty: it runs
  std::string name;   // by which users tell programs of a body apart: "front_lidar"; may be empty
};

}  // namespace tessera
