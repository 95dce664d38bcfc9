// What is measured.
#include <absl/strings/string_view.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "worlds/gazebo/publication.h"
#include "worlds/gazebo/system_kinds.h"
#include "worlds/gazebo/trigger.h"

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

// The <pose> of a plugin, which is in its model, in one of its links; nothing where one of the poses is
// malformed or relative to something.
std::optional<Pose> pose_in(const Element& link, const Element& plugin) {
  std::array<Pose, 2> poses;
  for (const auto& [element, pose] : {std::pair{&link, &poses[0]}, std::pair{&plugin, &poses[1]}}) {
    const Element* const given = element->FirstChildElement("pose");
    if (given == nullptr) continue;
    const absl::StatusOr<xml::RelativePose> read = xml::pose_of(*given);
    if (!read.ok() || !read->relative_to.empty()) return std::nullopt;
    *pose = read->pose;
  }
  return poses[0].inverse() * poses[1];
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

// A zone that counts what is in it.
void take_performer_detector(System& system) {
  const Element* const box = find(&system.plugin(), {"geometry", "box"});
  const Element* const size = find(box, {"size"});
  if (size == nullptr) return system.fail("it has no <geometry> with a <box>");
  const absl::StatusOr<Eigen::Vector3d> sides = xml::vector_in(*size, xml::text_of(*size));
  if (!sides.ok()) return system.fail(sides.status().message());
  Element* const link = system.first_link();
  if (link == nullptr) return;
  if (system.parts().is_static()) {
    for (const Element* other = link; other != nullptr; other = other->NextSiblingElement("link")) {
      if (other->FirstChildElement("collision") != nullptr)
        return system.fail(
            "its model is static and has collisions: only a model without them can become a zone");
    }
  }
  const std::optional<Pose> in_link = pose_in(*link, system.plugin());
  if (!in_link) return system.fail("its <pose>, or that of its link, is malformed or relative to something");
  const absl::Status added = add_trigger(*link, "performer_detector", *in_link, *sides);
  if (!added.ok()) return system.fail(added.message());
  if (system.parts().is_static()) system.parts().make_kinematic();
  system.note("everything that can move counts as a performer");
  system.write(ProgramWriter("pad", system.name()), *link);
}

void take_touch(System& system) { sensor_without_noise(system, "touch"); }

// What it waits for, and whom it tells, is known once all of the world is: the relays of its first link are
// moved there.
void take_triggered_publisher(System& system) {
  const absl::StatusOr<std::vector<Publication>> publications = publications_of(system.plugin());
  if (!publications.ok()) return system.fail(publications.status().message());
  Element* const link = system.first_link();
  if (link == nullptr) return;
  for (const Publication& publication : *publications) {
    ProgramWriter program("relay", last_word(publication.from));
    program.set(kPublishes, to_text(publication));
    system.write(program, *link);
  }
}

}  // namespace tessera::gazebo
