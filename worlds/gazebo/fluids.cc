#include "worlds/gazebo/fluids.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <cmath>

#include "lpss/model/limits.h"
#include "lpss/programs/registry.h"
#include "worlds/gazebo/numbers.h"
#include "worlds/gazebo/systems.h"

namespace tessera::gazebo {
namespace {

constexpr char kBuoyancy[] = "buoyancy";
constexpr char kWindEffects[] = "wind-effects";
constexpr double kUnboundedLevel = 1e9;  // m: cut to what a program can have

bool is_wind(const xml::Element& element) {
  return xml::is(element, "plugin") && canonical_name(element) == kWindEffects;
}

// Clamped to its bounds.
void set_within(ProgramRecord& program, absl::string_view name, double value) {
  const NumberSpec& spec = *find_spec(*find_program(program.kind), name);
  set_number(program, name, std::clamp(value, spec.least, spec.most)).IgnoreError();
}

void add(const ProgramRecord& program, BodyDescription& body, Notices& notices) {
  if (body.programs.size() < kProgramsPerBodyMax) {
    body.programs.push_back(program);
  } else {
    notices.count(absl::StrCat("program ", program.kind, " of a body that has ", kProgramsPerBodyMax,
                               " already, left out"));
  }
}

}  // namespace

bool Fluids::is_water(const xml::Element& element) {
  return xml::is(element, "plugin") && canonical_name(element) == kBuoyancy;
}

bool Fluids::is_one(const xml::Element& element) {
  if (!xml::is(element, "wind")) return is_water(element) || is_wind(element);
  // Without the system, nobody feels it.
  for (const xml::Element* other = &element; other != nullptr; other = other->NextSiblingElement("plugin")) {
    if (is_wind(*other)) return true;
  }
  for (const xml::Element* other = &element; other != nullptr;
       other = other->PreviousSiblingElement("plugin")) {
    if (is_wind(*other)) return true;
  }
  return false;
}

absl::Status Fluids::take(const xml::Element& element, Notices& notices) {
  if (xml::is(element, "wind")) {
    const xml::Element* const velocity = element.FirstChildElement("linear_velocity");
    if (velocity == nullptr) return absl::OkStatus();
    const absl::StatusOr<Eigen::Vector3d> air = xml::vector_in(*velocity, xml::text_of(*velocity));
    if (!air.ok()) return air.status();
    air_ = *air;
    return absl::OkStatus();
  }
  Numbers numbers;
  if (is_wind(element)) {
    drag_ = std::abs(numbers.read(element, "force_approximation_scaling_factor", 1));
    for (const char* part : {"horizontal", "vertical"}) {
      if (element.FirstChildElement(part) != nullptr)
        notices.count(absl::StrCat("<plugin> wind effects: changes and noise of its <", part,
                                   "> part are not simulated"));
    }
    return numbers.status();
  }
  Water& water = water_.emplace();
  if (const xml::Element* const graded = element.FirstChildElement("graded_buoyancy")) {
    water.density = numbers.read(*graded, "default_density", 1000);
    const xml::Element* const change = graded->FirstChildElement("density_change");
    if (change != nullptr) {
      water.level = numbers.read(*change, "above_depth", 0);
      water.air = numbers.read(*change, "density", 0);
      if (change->NextSiblingElement("density_change") != nullptr)
        notices.count(
            "<plugin> buoyancy: of several changes of density, the first is the surface of the water");
    }
  } else {
    water.density = numbers.read(element, "uniform_fluid_density", 1000);
  }
  for (const xml::Element* only = element.FirstChildElement("enable"); only != nullptr;
       only = only->NextSiblingElement("enable")) {
    water.only.insert(xml::text_of(*only));
  }
  return numbers.status();
}

bool Fluids::is_wet(const std::string& body) const {
  if (!water_) return false;
  return water_->only.empty() || std::ranges::any_of(water_->only, [&](const std::string& name) {
           return body == name || absl::StartsWith(body, name + "::");
         });
}

void Fluids::surround(const std::optional<Displacement>& displaced, bool feels_wind,
                      const Eigen::Vector3d& start, BodyDescription& body, Notices& notices) const {
  if (body.properties.motion != Motion::kDynamic) return;
  if (displaced && is_wet(body.name)) {
    ProgramRecord floater = *new_program("floater");
    const Eigen::Vector3d middle = displaced->centre - Eigen::Vector3d(body.properties.centre.data());
    // Everywhere: as high as a program can have it.
    set_within(floater, "level", water_->level ? *water_->level - start.z() : kUnboundedLevel);
    set_within(floater, "density", water_->density);
    set_within(floater, "air", water_->air);
    set_within(floater, "length", displaced->size.x());
    set_within(floater, "width", displaced->size.y());
    set_within(floater, "height", displaced->size.z());
    set_within(floater, "x", middle.x());
    set_within(floater, "y", middle.y());
    set_within(floater, "z", middle.z());
    set_within(floater, "drag", 0);
    set_within(floater, "damping", 0);
    add(floater, body, notices);
    notices.count("<plugin> buoyancy is the program floater");
  }
  if (feels_wind && drag_ > 0 && !air_.isZero(0)) {
    ProgramRecord wind = *new_program("wind");
    set_within(wind, "damping", drag_);
    set_within(wind, "x", air_.x());
    set_within(wind, "y", air_.y());
    set_within(wind, "z", air_.z());
    add(wind, body, notices);
    notices.count("<plugin> wind effects is the program wind");
  }
}

}  // namespace tessera::gazebo
