// The programs of a link (docs/programs.md):
//
//   <tessera:program kind="character" step="0.3" x="1"/>
//
// Attributes are parameters and inputs by their names, in the units of the program's tables; where a number
// is a body, the body's name in the world.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <sdf/Link.hh>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/program.h"
#include "worlds/loader/xml.h"

namespace tessera {

// How libsdformat passes on what a <link> says of its programs.
inline constexpr absl::string_view kProgram = "tessera:program";

// Checks all of them, and keeps them as one element. Errors name the attribute and its bound.
absl::Status keep_programs(xml::Element& link);

struct ProgramTemplate {
  ProgramRecord record;
  std::vector<std::pair<std::uint32_t, std::string>> bodies;  // parameters that are bodies, by their names
};

std::vector<ProgramTemplate> programs_of(const sdf::Link& link);

}  // namespace tessera
