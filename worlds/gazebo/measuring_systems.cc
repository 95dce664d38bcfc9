// What is measured.
#include <absl/strings/string_view.h>

#include <cmath>
#include <optional>
#include <string>

#include "worlds/gazebo/system_kinds.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

// Where a sensor is that its model has as a plugin: in a link that it names, or else in the first one.
std::optional<ModelParts::Place> place_of_sensor(System& system) {
  const std::string name =
      system.text({"bodyName", "body_name", "linkName", "link_name", "frameName", "frame_name"});
  if (!name.empty()) return system.place(name);
  Element* const link = system.first_link();
  if (link == nullptr) return std::nullopt;
  return ModelParts::Place{link, {}};
}

void sensor_without_noise(System& system, absl::string_view kind) {
  if (const std::optional<ModelParts::Place> place = place_of_sensor(system))
    system.write(ProgramWriter(kind, system.name()), *place->link);
}

}  // namespace

void take_imu(System& system) {
  const std::optional<ModelParts::Place> place = place_of_sensor(system);
  if (!place) return;
  ProgramWriter program("imu", system.name());
  const double noise = std::abs(system.number({"gaussianNoise", "gaussian_noise"}, 0));
  program.set_place(place->pose).set_turn(place->pose).set("noise", noise).set("turn_noise", noise);
  system.write(program, *place->link);
}

void take_pose(System& system) {
  const std::optional<ModelParts::Place> place = place_of_sensor(system);
  if (!place) return;
  ProgramWriter program("pose", system.name());
  program.set("noise", std::abs(system.number({"gaussian_noise", "gaussianNoise"}, 0)));
  system.write(program, *place->link);
}

void take_barometer(System& system) { sensor_without_noise(system, "barometer"); }
void take_magnetometer(System& system) { sensor_without_noise(system, "magnetometer"); }
void take_touch(System& system) { sensor_without_noise(system, "touch"); }

}  // namespace tessera::gazebo
