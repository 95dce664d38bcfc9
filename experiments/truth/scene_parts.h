// Building blocks of scenes in several groups.
#pragma once

#include <string>

#include "experiments/truth/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::truth {

// With uniform gravity (m/s^2), and no sleep.
WorldSettings with_gravity(WorldSettings settings, const Eigen::Vector3d& gravity);

// m/s^2, of a gravity that leans by `slope` (rad) towards `down` (unit length, level).
Eigen::Vector3d slope_pull(double slope, const Eigen::Vector3d& down);

// A floor at z = 0 that is level, under a gravity that leans by `slope` (rad) towards +x: a slope.
WorldBuilder on_slope(const WorldSettings& settings, double slope, double friction, double restitution = 0);
// The same without a lean.
WorldBuilder on_plane(const WorldSettings& settings, double friction, double restitution = 0);

// A body whose surface is so, at rest.
BodyDescription& add_body(WorldBuilder& builder, const std::string& name, Geometry geometry, double mass,
                          const Eigen::Vector3d& place, double friction, double restitution = 0);

// A scene of what Bullet does not have.
Scene scene_without_bullet(const std::string& group, const std::string& name, double seconds);
// Likewise, of the group `programs`.
Scene program_scene(const std::string& name, double seconds = 10);

}  // namespace tessera::truth
