#include "experiments/truth/scene_parts.h"

#include <cmath>
#include <utility>

namespace tessera::truth {

WorldSettings with_gravity(WorldSettings settings, const Eigen::Vector3d& gravity) {
  settings.gravity = UniformGravity{gravity};
  settings.sleep_after = 0;
  return settings;
}

Eigen::Vector3d slope_pull(double slope, const Eigen::Vector3d& down) {
  return kGravity * (std::sin(slope) * down - std::cos(slope) * Eigen::Vector3d::UnitZ());
}

WorldBuilder on_slope(const WorldSettings& settings, double slope, double friction, double restitution) {
  WorldBuilder builder(with_gravity(settings, slope_pull(slope, Eigen::Vector3d::UnitX())));
  BodyDescription& ground = builder.add("ground", builder.shape(Plane{}), 1, {0, 0, 0}, Motion::kStatic);
  ground.properties.friction = friction;
  ground.properties.restitution = restitution;
  return builder;
}

WorldBuilder on_plane(const WorldSettings& settings, double friction, double restitution) {
  return on_slope(settings, 0, friction, restitution);
}

BodyDescription& add_body(WorldBuilder& builder, const std::string& name, Geometry geometry, double mass,
                          const Eigen::Vector3d& place, double friction, double restitution) {
  BodyDescription& body = builder.add(name, builder.shape(std::move(geometry)), mass, place);
  body.properties.friction = friction;
  body.properties.restitution = restitution;
  return body;
}

Scene scene_without_bullet(const std::string& group, const std::string& name, double seconds) {
  Scene scene;
  scene.group = group;
  scene.name = name;
  scene.seconds = seconds;
  scene.in_bullet = false;
  return scene;
}

Scene program_scene(const std::string& name, double seconds) {
  return scene_without_bullet("programs", name, seconds);
}

}  // namespace tessera::truth
