// What flies and swims.
#include <absl/strings/str_cat.h>

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "lpss/base/portable_math.h"
#include "worlds/gazebo/added_mass.h"
#include "worlds/gazebo/system_kinds.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

// rad/s, of the motor of a joint.
double fastest_of(const ModelParts& parts, const std::string& joint) {
  constexpr double kFastest = 800;
  for (const Element* plugin = parts.model().FirstChildElement("plugin"); plugin != nullptr;
       plugin = plugin->NextSiblingElement("plugin")) {
    if (text_of_any(*plugin, {"jointName", "joint_name"}) != joint) continue;
    Numbers numbers;
    return numbers.read(*plugin, {"maxRotVelocity", "max_rot_velocity"}, kFastest);
  }
  return kFastest;
}

// What its rotors can do.
struct Rotors {
  int count = 0;
  double thrust = 0;       // N, of all
  double torque = 0;       // N m, by which they lean the body
  double turn_torque = 0;  // N m, by their reactions
};

Rotors rotors_of(System& system) {
  Rotors all;
  Numbers numbers;
  for (const Element* rotor = find(&system.plugin(), {"rotorConfiguration", "rotor"}); rotor != nullptr;
       rotor = rotor->NextSiblingElement("rotor")) {
    const std::string name = xml::child_text(*rotor, "jointName");
    const Element* const joint = system.joint(name);
    if (joint == nullptr) return all;
    const Element* const link = system.side(*joint, "child");
    if (link == nullptr) return all;
    const double fastest = fastest_of(system.parts(), name);
    const double thrust = numbers.read(*rotor, "forceConstant", 0) * fastest * fastest;
    const Element* const given = link->FirstChildElement("pose");
    const absl::StatusOr<xml::RelativePose> pose =
        given == nullptr ? xml::RelativePose{} : xml::pose_of(*given);
    if (!pose.ok()) system.fail(pose.status().message());
    const double arm = pose.ok() ? pose->pose.position.head<2>().norm() : 0;
    ++all.count;
    all.thrust += thrust;
    // While half of them push, and the others do not.
    all.torque += thrust * arm / 2;
    all.turn_torque += thrust * numbers.read(*rotor, "momentConstant", 0) / 2;
  }
  if (!numbers.status().ok()) system.fail(numbers.status().message());
  return all;
}

}  // namespace

void take_motor(System& system) {
  Element* const joint = system.joint(system.text({"jointName", "joint_name"}));
  if (joint == nullptr) return;
  Element* const rotor = system.side(*joint, "child");
  Element* const frame = system.side(*joint, "parent");
  if (rotor == nullptr || frame == nullptr) return;
  const double speed = system.number({"maxRotVelocity", "max_rot_velocity"}, 838);
  const double constant = system.number({"motorConstant", "motor_constant"}, 8.54858e-6);
  const double moment = system.number({"momentConstant", "moment_constant"}, 0.016);
  const std::string turning = system.text({"turningDirection", "turning_direction"});
  ProgramWriter program("thruster", system.name());
  // The rotor turns in Gazebo, and pushes along its joint; here it need not, and pushes along the z axis.
  program.set("rise", std::numbers::pi / 2)
      .set("force", constant * speed * speed)
      .set("reaction", turning == "cw" ? moment : -moment)
      .set("lag", system.number({"timeConstantUp", "time_constant_up"}, 1.0 / 80));
  system.write(program, *rotor);
  write_drive(*joint, "velocity", 0);
}

void take_propeller(System& system) {
  Element* const joint = system.joint(system.text({"joint_name"}));
  if (joint == nullptr) return;
  Element* const link = system.side(*joint, "child");
  if (link == nullptr) return;
  // It pushes along the axis of its joint.
  const Element* const xyz = find(joint, {"axis", "xyz"});
  const Element* const turned = joint->FirstChildElement("pose");
  const absl::StatusOr<Eigen::Vector3d> axis =
      xyz == nullptr ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : xml::vector_in(*xyz, xml::text_of(*xyz));
  const absl::StatusOr<xml::RelativePose> pose =
      turned == nullptr ? xml::RelativePose{} : xml::pose_of(*turned);
  if (!axis.ok()) return system.fail(axis.status().message());
  if (!pose.ok()) return system.fail(pose.status().message());
  if (!pose->relative_to.empty() || (xyz != nullptr && xyz->Attribute("expressed_in") != nullptr))
    return system.fail("the axis of its joint must be along axes of its link");
  const Eigen::Vector3d way = pose->pose.orientation * *axis;
  ProgramWriter program("thruster", system.name());
  program.set_place({pose->pose.position, Eigen::Quaterniond::Identity()})
      .set("turn", portable::atan2(way.y(), way.x()))
      .set("rise", portable::atan2(way.z(), std::sqrt(way.x() * way.x() + way.y() * way.y())))
      .set("force", system.number({"max_thrust_cmd"}, 1000));
  system.write(program, *link);
}

void take_lift_drag(System& system) {
  const std::string name = system.text({"link_name"});
  const std::optional<ModelParts::Place> place = system.place(name);
  if (!place) return;
  const Eigen::Vector3d forward = system.vector("forward", Eigen::Vector3d::UnitX());
  const Eigen::Vector3d upward = system.vector("upward", Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d cp = system.vector("cp", Eigen::Vector3d::Zero());
  const Eigen::Vector3d across = upward.cross(forward);
  if (across.norm() == 0) return system.fail("<forward> and <upward> must have different directions");
  Pose pose{cp, {}};
  Eigen::Matrix3d axes;
  axes << forward.normalized(), across.normalized(), forward.cross(across).normalized();
  pose.orientation = Eigen::Quaterniond(axes);
  const Eigen::Vector3d angles = xml::angles_of(pose.orientation);
  // Gazebo's drag grows with the angle, and this one with its square: they are alike where it stalls.
  const double slope = system.number({"cla"}, 1);
  const double stall = std::abs(system.number({"alpha_stall"}, std::numbers::pi / 2));
  const double at_stall = slope * stall;
  const double drag = std::abs(system.number({"cda"}, 0.01)) * stall;
  ProgramWriter program("wing", system.name());
  program.set_place(pose)
      .set("roll", angles.x())
      .set("rise", -angles.y())
      .set("turn", angles.z())
      .set("area", system.number({"area"}, 1))
      .set("density", system.number({"air_density"}, 1.2041))
      .set("slope", slope)
      .set("zero_lift", -system.number({"a0", "alpha0"}, 0))
      .set("stall", std::min(stall, 1.5))
      .set("drag", at_stall == 0 ? drag : 0)
      .set("induced", at_stall == 0 ? 0 : drag / (at_stall * at_stall));
  system.write(program, *place->link);
}

void take_multicopter(System& system) {
  const std::string name = system.text({"comLinkName"});
  const std::optional<ModelParts::Place> place =
      name.empty() ? ModelParts::Place{system.first_link(), {}} : system.place(name);
  if (!place || place->link == nullptr) return;
  const Rotors rotors = rotors_of(system);
  if (rotors.count == 0) return system.fail("it names no <rotor> in its <rotorConfiguration>");
  const Eigen::Vector3d fastest = system.vector("maximumLinearAcceleration", {3, 3, 3});
  ProgramWriter program("multicopter", system.name());
  program.set("thrust", rotors.thrust)
      .set("torque", rotors.torque)
      .set("turn_torque", rotors.turn_torque)
      .set("load", system.parts().mass(place->link))
      .set("acceleration", accelerates(fastest.cwiseAbs().minCoeff()));
  system.write(program, *place->link);
}

// Of T. I. Fossen's derivatives, which are below 0, those on the diagonal.
void take_hydrodynamics(System& system) {
  const std::optional<ModelParts::Place> place = system.place(system.text({"link_name"}));
  if (!place) return;
  struct Derivative {
    const char* number;
    std::array<const char*, 2> spellings;
  };
  constexpr std::array kDerivatives = {
      Derivative{"mass_x", {"xDotU", "xDotU"}},
      Derivative{"mass_y", {"yDotV", "yDotV"}},
      Derivative{"mass_z", {"zDotW", "zDotW"}},
      Derivative{"inertia_x", {"kDotP", "kDotP"}},
      Derivative{"inertia_y", {"mDotQ", "mDotQ"}},
      Derivative{"inertia_z", {"nDotR", "nDotR"}},
      Derivative{"drag_x", {"xU", "xU"}},
      Derivative{"drag_y", {"yV", "yV"}},
      Derivative{"drag_z", {"zW", "zW"}},
      Derivative{"turn_drag_x", {"kP", "kP"}},
      Derivative{"turn_drag_y", {"mQ", "mQ"}},
      Derivative{"turn_drag_z", {"nR", "nR"}},
      Derivative{"square_drag_x", {"xUabsU", "xUU"}},
      Derivative{"square_drag_y", {"yVabsV", "yVV"}},
      Derivative{"square_drag_z", {"zWabsW", "zWW"}},
      Derivative{"square_turn_drag_x", {"kPabsP", "kPP"}},
      Derivative{"square_turn_drag_y", {"mQabsQ", "mQQ"}},
      Derivative{"square_turn_drag_z", {"nRabsR", "nRR"}},
  };
  // Of water that the link tells of, too.
  const absl::StatusOr<std::optional<AddedMass>> given = take_added_mass(*place->link);
  if (!given.ok()) return system.fail(given.status().message());
  const AddedMass added = given->value_or(AddedMass{});
  if (added.has_others) system.note("<fluid_added_mass> beside the diagonal is not simulated");
  const bool takes_water_along = !system.flag("disable_added_mass", false);
  if (system.flag("disable_coriolis", false)) system.note("<disable_coriolis> is not used");
  ProgramWriter program("hydrodynamics", system.name());
  for (std::size_t n = 0; n < kDerivatives.size(); ++n) {
    const auto& [number, spellings] = kDerivatives[n];
    double value = std::abs(system.number({spellings[0], spellings[1]}, 0));
    if (n < 6) {
      const Eigen::Vector3d& of_link = n < 3 ? added.mass : added.inertia;
      value = of_link[static_cast<Eigen::Index>(n % 3)] + (takes_water_along ? value : 0);
    }
    program.set(number, value);
  }
  const Eigen::Vector3d current = system.vector("default_current", Eigen::Vector3d::Zero());
  program.set("current_x", current.x()).set("current_y", current.y()).set("current_z", current.z());
  for (const char* cross : {"xDotV", "xV", "xVabsV", "yDotR", "yR", "nV", "nVabsV", "mW", "zQ"}) {
    if (system.number({cross}, 0) != 0) system.note("derivatives between two axes are not simulated");
  }
  system.write(program, *place->link);
}

}  // namespace tessera::gazebo
