#include "experiments/paper/small_scenes.h"

#include "lpss/simulation/example_worlds.h"

namespace tessera {

WorldDescription collision_scene(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  builder.world().settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  const ShapeId ball = builder.shape(Sphere{0.5});
  constexpr double kSpeed = 5;    // m/s
  constexpr double kHalf = 2.07;  // m: 3.14 m between the surfaces are 18.8 ticks of 1/60 s
  for (const int side : {-1, 1}) {
    BodyDescription& body = builder.add(side < 0 ? "left" : "right", ball, 1, {side * kHalf, side * 0.1, 0});
    body.linear_velocity.x() = -side * kSpeed;
    body.properties.restitution = 0.5;
  }
  return builder.world();
}

absl::Status move_to(WorldDescription& world, const WorldPosition& place) {
  const auto move = [&, size = world.settings.sector_size](SectorIndex& sector,
                                                           Eigen::Vector3d& local) -> absl::Status {
    const absl::StatusOr<SectorIndex> there =
        translated(sector, {place.sector.i, place.sector.j, place.sector.k});
    if (!there.ok()) return there.status();
    const absl::StatusOr<WorldPosition> moved = canonical(*there, local + place.local, size);
    if (!moved.ok()) return moved.status();
    sector = moved->sector;
    local = moved->local;
    return absl::OkStatus();
  };
  for (BodyDescription& body : world.bodies) {
    WorldPosition& position = body.pose.position;
    if (absl::Status status = move(position.sector, position.local); !status.ok()) return status;
  }
  for (JointDescription& joint : world.joints) {
    JointProperties& properties = joint.properties;
    if (properties.parent != BodyId{}) continue;
    if (absl::Status status = move(properties.anchor, properties.in_parent.position); !status.ok())
      return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera
