// Numbers at the limits of their range: the world is refused with a message, or runs without losing a number.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "experiments/extremes/figures.h"
#include "lpss/model/limits.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

using Limits = std::numeric_limits<double>;

// A box on a floor with a slider beside it.
WorldDescription small_world(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  builder.add_floor(10, 0);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 0.5});
  builder.add("slide", builder.shape(Sphere{0.2}), 1, {2, 0, 1});
  builder.tie("rail", JointType::kPrismatic, "", "slide", {2, 0, 1});
  return builder.world();
}

// A body may be stopped once, which is reported; being stopped repeatedly is a failure.
double numbers_lost_or_stops(const Moment& start, const Moment& now) {
  const double stopped_again = static_cast<double>(now.stopped) - static_cast<double>(now.bodies.size());
  return numbers_lost(start, now) + std::max(0.0, stopped_again);
}

// Sets one number of the world.
using Change = std::function<void(WorldDescription& world, double number)>;

BodyDescription& box(WorldDescription& world) { return world.bodies[1]; }
JointDescription& rail(WorldDescription& world) { return world.joints[0]; }

Change of_settings(double WorldSettings::*number) {
  return [number](WorldDescription& world, double value) { world.settings.*number = value; };
}

Change of_box(double BodyProperties::*number) {
  return [number](WorldDescription& world, double value) { box(world).properties.*number = value; };
}

Change of_rail(double JointAxis::*number) {
  return [number](WorldDescription& world, double value) { rail(world).properties.axes[0].*number = value; };
}

Change of_drive(DriveMode mode) {
  return [mode](WorldDescription& world, double value) { rail(world).drives[0] = {mode, value}; };
}

void set_geometry(WorldDescription& world, Geometry geometry) {
  world.shapes[box(world).properties.shape].parts[0].geometry = std::move(geometry);
}

CentralGravity& make_planet(WorldDescription& world) {
  world.settings.gravity = CentralGravity{{{}, {0, 0, -1000}}, kStandardGravity, 1000};
  return std::get<CentralGravity>(world.settings.gravity);
}

const std::pair<const char*, Change> kChanges[] = {
    {"mass", of_box(&BodyProperties::mass)},
    {"inertia",
     [](WorldDescription& world, double value) {
       box(world).properties.inertia = {value, value, value};
     }},
    {"one_moment_of_inertia",
     [](WorldDescription& world, double value) { box(world).properties.inertia[1] = value; }},
    {"centre_of_mass",
     [](WorldDescription& world, double value) { box(world).properties.centre[0] = value; }},
    {"friction", of_box(&BodyProperties::friction)},
    {"restitution", of_box(&BodyProperties::restitution)},
    {"linear_damping", of_box(&BodyProperties::linear_damping)},
    {"angular_damping", of_box(&BodyProperties::angular_damping)},
    {"position", [](WorldDescription& world, double value) { box(world).pose.position.local.x() = value; }},
    {"orientation", [](WorldDescription& world, double value) { box(world).pose.orientation.x() = value; }},
    {"velocity", [](WorldDescription& world, double value) { box(world).linear_velocity.y() = value; }},
    {"spin", [](WorldDescription& world, double value) { box(world).angular_velocity.z() = value; }},
    {"box_size",
     [](WorldDescription& world, double value) {
       set_geometry(world, Box{{1, value, 1}});
     }},
    {"ball_radius", [](WorldDescription& world, double value) { set_geometry(world, Sphere{value}); }},
    {"capsule_length",
     [](WorldDescription& world, double value) {
       set_geometry(world, Capsule{0.5, value});
     }},
    {"hull_point",
     [](WorldDescription& world, double value) {
       set_geometry(world, ConvexHull{{{0, 0, value}, {1, 0, -0.5}, {0, 1, -0.5}, {-1, -1, -0.5}}});
     }},
    {"gravity",
     [](WorldDescription& world, double value) {
       world.settings.gravity = UniformGravity{{0, 0, -value}};
     }},
    {"planet_surface_gravity",
     [](WorldDescription& world, double value) { make_planet(world).surface = value; }},
    {"planet_radius", [](WorldDescription& world, double value) { make_planet(world).radius = value; }},
    {"planet_centre",
     [](WorldDescription& world, double value) { make_planet(world).centre.local.x() = value; }},
    {"time_step", of_settings(&WorldSettings::time_step)},
    {"sector_size", of_settings(&WorldSettings::sector_size)},
    {"sleep_speed", of_settings(&WorldSettings::sleep_linear_speed)},
    {"sleep_after", of_settings(&WorldSettings::sleep_after)},
    {"rail_end", of_rail(&JointAxis::upper)},
    {"rail_velocity_limit",
     [](WorldDescription& world, double value) {
       of_rail (&JointAxis::velocity_max)(world, value);
       of_drive(DriveMode::kPosition)(world, 1);
     }},
    {"rail_effort_limit",
     [](WorldDescription& world, double value) {
       of_rail (&JointAxis::effort_max)(world, value);
       of_drive(DriveMode::kVelocity)(world, 1);
     }},
    {"rail_damping",
     [](WorldDescription& world, double value) {
       of_rail (&JointAxis::damping)(world, value);
       world.bodies[2].linear_velocity.x() = 1;
     }},
    {"rail_friction",
     [](WorldDescription& world, double value) {
       of_rail (&JointAxis::friction)(world, value);
       world.bodies[2].linear_velocity.x() = 1;
     }},
    {"drive_to_position", of_drive(DriveMode::kPosition)},
    {"drive_at_velocity", of_drive(DriveMode::kVelocity)},
    {"drive_with_effort", of_drive(DriveMode::kEffort)},
};

const std::pair<const char*, double> kNumbers[] = {
    {"denormal", Limits::denorm_min()},  // of double
    {"denormal_in_f32", 1e-40},
    {"huge_in_f32", 1e30},  // its square overflows f32
    {"huge", Limits::max()},
    {"huge_negative", Limits::lowest()},
    {"no_number", Limits::quiet_NaN()},
};

Scene input_scene(const std::string& name, const std::function<void(WorldDescription& world)>& change) {
  Scene scene;
  scene.group = "input";
  scene.name = name;
  scene.world = [change](const WorldSettings& settings) {
    WorldDescription world = small_world(settings);
    change(world);
    return world;
  };
  scene.lasts = {120, 120};
  scene.asks = {numbers_lost_or_stops, "numbers lost, or repeated stops", 0, "It runs.",
                "It loses numbers, or is stopped repeatedly."};
  scene.may_be_refused = true;
  return scene;
}

// Commands for the box that a coordinator accepts.
Scene command_scene(const std::string& name, const Command& command) {
  Scene scene = input_scene(name, [](WorldDescription&) {});
  scene.commands = {command};
  return scene;
}

}  // namespace

std::vector<Scene> input_scenes() {
  std::vector<Scene> scenes;
  for (const auto& [what, change] : kChanges) {
    for (const auto& [which, number] : kNumbers) {
      scenes.push_back(input_scene(absl::StrCat(what, "_", which),
                                   [&change, number](WorldDescription& world) { change(world, number); }));
    }
  }
  constexpr BodyId kBox{2};
  scenes.push_back(command_scene("largest_impulse", ApplyImpulse{kBox, {0, 0, kImpulseMax}, {}}));
  scenes.push_back(command_scene("largest_lever", ApplyImpulse{kBox, {0, 0, 1}, {kLeverMax, 0, 0}}));
  scenes.push_back(command_scene("largest_force", ApplyForce{kBox, {{kForceMax, 0, 0}, {}}}));
  scenes.push_back(command_scene("largest_torque", ApplyForce{kBox, {{}, {0, 0, kTorqueMax}}}));
  scenes.push_back(command_scene("largest_spin", SetVelocity{kBox, {}, {0, 0, kAngularSpeedMax}}));
  scenes.push_back(command_scene("largest_speed", SetVelocity{kBox, {0, kSpeedMax, 0}, {}}));
  return scenes;
}

}  // namespace tessera::extremes
