#include "experiments/extremes/scene_parts.h"

#include <algorithm>
#include <utility>

namespace tessera::extremes {

WorldSettings sleepless(WorldSettings settings) {
  settings.sleep_after = 0;
  return settings;
}

WorldSettings weightless(WorldSettings settings) {
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  return sleepless(std::move(settings));
}

Build with_settings(const WorldSettings& own, Build world) {
  return [own, world = std::move(world)](const WorldSettings& given) {
    WorldSettings settings = own;
    settings.precision = given.precision;
    return world(settings);
  };
}

Scene refused_scene(const std::string& group, const std::string& name, Build world,
                    const std::string& fails) {
  Scene scene{
      .group = group,
      .name = name,
      .world = std::move(world),
      .lasts = {1, 1},
      .asks = {[](const Moment&, const Moment&) { return 1.0; }, "accepted", 0, "It is refused.", fails}};
  scene.may_be_refused = true;
  return scene;
}

void measure_stretch(Scene& scene, double length) {
  scene.asks = {[length](const Moment&, const Moment& now) {
                  return std::max(0.0, now.positions.back().norm() - length) / length;
                },
                "relative elongation", 0.01, "The chain keeps its length.", "The chain stretches."};
}

}  // namespace tessera::extremes
