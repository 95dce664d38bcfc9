// The programs of a link (docs/programs.md):
//
//   <tessera:program kind="character" step="0.3" x="1"/>
//   <tessera:program module="flee.wasm" speed="2"/>
//
// A module is a file beside the world file, or the model's.
//
// Attributes are parameters and inputs by their names, in the units of the program's tables; where a number
// is a body or joint, its name in the model of the link, or else in the world.
#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <sdf/Link.hh>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/program.h"
#include "lpss/model/world_description.h"
#include "worlds/loader/xml.h"

namespace tessera {

// How libsdformat passes on what a <link> says of its programs.
inline constexpr absl::string_view kProgram = "tessera:program";

// Checks all of them, of a file in `directory`, and keeps them as one element. Modules that are new are added
// to `modules`. Errors name the attribute and its bound.
absl::Status keep_programs(xml::Element& link, const std::filesystem::path& directory,
                           ProgramModules& modules);

struct ProgramTemplate {
  ProgramRecord record;
  std::vector<std::pair<std::uint32_t, std::string>> named;  // parameters that are bodies or joints
};

std::vector<ProgramTemplate> programs_of(const sdf::Link& link);

// Gives bodies of a world their programs, and finds what these name once all bodies and joints are there.
class ProgramPlacer {
 public:
  // To `body`, which comes to `place` in the world; errors will name `element`.
  void add(const std::vector<ProgramTemplate>& programs, const xml::Element& element, std::size_t place,
           BodyDescription& body);
  absl::Status resolve(WorldDescription& world) const;

 private:
  // A parameter of a program that is a body or joint.
  struct Named {
    std::size_t body = 0;  // whose program it is
    std::size_t program = 0;
    std::size_t parameter = 0;
    std::string name;
    const xml::Element* element = nullptr;
  };
  std::vector<Named> named_;
};

}  // namespace tessera
