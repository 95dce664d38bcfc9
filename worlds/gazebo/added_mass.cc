#include "worlds/gazebo/added_mass.h"

#include <absl/strings/str_cat.h>

#include <array>

#include "worlds/gazebo/numbers.h"
#include "worlds/gazebo/program_writer.h"

namespace tessera::gazebo {
namespace {

constexpr char kAddedMass[] = "fluid_added_mass";

}  // namespace

absl::StatusOr<std::optional<AddedMass>> take_added_mass(xml::Element& link) {
  xml::Element* const inertial = link.FirstChildElement("inertial");
  xml::Element* const given = inertial == nullptr ? nullptr : inertial->FirstChildElement(kAddedMass);
  if (given == nullptr) return std::nullopt;
  Numbers numbers;
  const auto number = [&](const char* name) { return numbers.read(*given, name, 0); };
  AddedMass added;
  added.mass = {number("xx"), number("yy"), number("zz")};
  added.inertia = {number("pp"), number("qq"), number("rr")};
  constexpr std::array kOthers = {"xy", "xz", "xp", "xq", "xr", "yz", "yp", "yq",
                                  "yr", "zp", "zq", "zr", "pq", "pr", "qr"};
  for (const char* name : kOthers) added.has_others |= number(name) != 0;
  if (!numbers.status().ok()) return numbers.status();
  inertial->DeleteChild(given);
  return added;
}

void take_added_masses(const ModelParts& parts, Notices& notices) {
  for (xml::Element* link = parts.first_link(); link != nullptr; link = link->NextSiblingElement("link")) {
    const absl::StatusOr<std::optional<AddedMass>> added = take_added_mass(*link);
    if (added.ok() && !*added) continue;
    absl::Status status = added.status();
    if (status.ok()) {
      const auto& [mass, inertia, has_others] = **added;
      ProgramWriter program("hydrodynamics", "added_mass");
      program.set("mass_x", mass.x()).set("mass_y", mass.y()).set("mass_z", mass.z());
      program.set("inertia_x", inertia.x()).set("inertia_y", inertia.y()).set("inertia_z", inertia.z());
      status = program.write(*link);
      if (status.ok()) notices.count(absl::StrCat("<", kAddedMass, "> is the program hydrodynamics"));
      if (status.ok() && has_others)
        notices.count(absl::StrCat("<", kAddedMass, ">: parts beside the diagonal are not simulated"));
    }
    if (!status.ok()) {
      notices.count_repair(absl::StrCat("<", kAddedMass, ">, left out: ", status.message()),
                           xml::place_of(*link));
    }
  }
}

}  // namespace tessera::gazebo
