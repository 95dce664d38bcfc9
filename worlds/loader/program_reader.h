// The programs of a link (docs/programs.md):
//
//   <tessera:program kind="character" step="0.3" x="1"/>
//   <tessera:program module="flee.wasm" name="shy" speed="2"/>
//
// A module is a file beside the world file, or the model's.
//
// `name` tells programs of a link apart. Other attributes are parameters and inputs by their names, in the
// units of the program's tables; where a number is a body or joint, its name in the model of the link, in one
// that this model is in, or else in the world; where it is the place of a program, value or input, that, or
// its name. Programs for sensors and systems of the file (worlds/gazebo/) are read alike; what is wrong with
// them is no error, but a notice.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <sdf/Link.hh>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/program.h"
#include "lpss/model/world_description.h"
#include "worlds/gazebo/publication.h"
#include "worlds/gazebo/surroundings.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/relays.h"
#include "worlds/loader/xml.h"

namespace tessera {

// How libsdformat passes on what a <link> says of its programs.
inline constexpr absl::string_view kProgram = "tessera:program";

// Checks all of them, of a file in `directory`, and keeps them as one element. Modules that are new are added
// to `modules`. Errors name the attribute and its bound.
absl::Status keep_programs(xml::Element& link, const std::filesystem::path& directory,
                           ProgramModules& modules, Notices& notices);

struct ProgramTemplate {
  ProgramRecord record;
  std::vector<std::pair<std::uint32_t, std::string>> named;  // parameters that are named
  bool is_of_system = false;  // of a sensor or system: where it cannot be, it is left out
  // Of a system or sensor: the topics on which it has its values, and on which it is told.
  std::string says = {};
  std::string hears = {};
  std::optional<gazebo::Publication> publishes = {};  // of a relay that has no place yet
};

std::vector<ProgramTemplate> programs_of(const sdf::Link& link);

// Whether a program of this kind measures, and does nothing else.
bool is_sensor(absl::string_view kind);

// Gives bodies of a world their programs, and finds what these name once all bodies and joints are there.
class ProgramPlacer {
 public:
  // To `body`, which comes to `place` in the world; errors will name `element`. `start`: its centre of mass,
  // m from the origin of the world.
  void add(const std::vector<ProgramTemplate>& programs, const xml::Element& element, std::size_t place,
           const Eigen::Vector3d& start, BodyDescription& body);
  // Of the world itself.
  void add_publisher(const xml::Element& plugin, Notices& notices);
  absl::Status resolve(WorldDescription& world, Notices& notices);

  gazebo::Surroundings surroundings;  // for sensors

 private:
  // A parameter of a program that is a body or joint, or the place of a program, value or input.
  struct Named {
    std::size_t body = 0;  // whose program it is
    std::size_t program = 0;
    std::size_t parameter = 0;
    std::string name;
    const xml::Element* element = nullptr;
    bool is_of_system = false;
  };
  absl::Status resolve_ids(WorldDescription& world, Notices& notices) const;
  static absl::Status resolve_place(const Named& named, WorldDescription& world);

  std::vector<Named> named_;
  Relays relays_;
};

}  // namespace tessera
