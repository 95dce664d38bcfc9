#include "experiments/paper/small_scenes.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

std::vector<Eigen::Vector3d> positions_from(const WorldPosition& origin,
                                            const std::vector<BodyRecord>& records, double sector_size) {
  std::vector<Eigen::Vector3d> positions;
  for (const BodyRecord& record : records) {
    const Eigen::Map<const Eigen::Vector3d> local(record.state.position.data());
    positions.push_back(metres_between(origin.sector, record.home, sector_size) + (local - origin.local));
  }
  return positions;
}

double largest_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const double distance = (a[i] - b[i]).norm();
    if (!std::isfinite(distance)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, distance);
  }
  return largest;
}

}  // namespace tessera
