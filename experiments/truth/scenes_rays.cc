// Rays at convex shapes, against closed forms.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

#include "experiments/truth/ray_oracle.h"
#include "experiments/truth/scene_parts.h"
#include "lpss/observe/queries.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

constexpr int kRays = 1'000'000;
constexpr int kQuickRays = 10'000;

// m: some roundings of numbers of the size of a sector.
double rounding_of(const WorldSettings& settings) {
  return settings.precision == Precision::kFloat32 ? 1e-5 : 1e-9;
}

struct Errors {
  double place = 0;   // m, of the point, across the surface
  double normal = 0;  // rad
  int wrong = 0;      // hit or missed by more than rounding
};

// The shape in a place of its own, turned, from all sides.
absl::StatusOr<Errors> errors_of(const WorldSettings& given, const Geometry& geometry, int rays) {
  const double tolerance = rounding_of(given);
  WorldBuilder builder(with_gravity(given, Vector3d::Zero()));
  const Pose pose{{kPlace, 0.7, -1.3}, Eigen::Quaterniond(0.5, 0.1, -0.7, 0.3).normalized()};
  add_body(builder, "solid", geometry, 1, pose.position, 0).pose.orientation = pose.orientation;
  const WorldDescription& world = builder.world();
  const absl::StatusOr<std::unique_ptr<PartitionCluster>> cluster = PartitionCluster::create(world, 1);
  if (!cluster.ok()) return cluster.status();
  const RayOracle right(geometry), smaller(geometry, -tolerance), larger(geometry, tolerance);
  std::mt19937_64 random(4711);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> away(1.2, 10);
  const auto any = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  Errors errors;
  for (int ray = 0; ray < rays; ++ray) {
    const Vector3d from = away(random) * any().normalized();
    const Vector3d direction = (0.4 * any() - from).normalized();
    const absl::StatusOr<WorldPosition> origin = canonical(world.anchor, pose * from, given.sector_size);
    if (!origin.ok()) return origin.status();
    const std::optional<RayAnswer> got =
        raycast((*cluster)->partition(0), *origin, pose.orientation * direction, 20, 0xffffffff);
    if (got ? !larger.distance(from, direction) : smaller.distance(from, direction).has_value())
      ++errors.wrong;
    const std::optional<double> answer = right.distance(from, direction);
    if (!got || !answer) continue;
    const Vector3d out = pose.orientation.conjugate() * got->normal;
    errors.place = std::max(errors.place, std::abs(got->distance - *answer) * std::abs(out.dot(direction)));
    errors.normal =
        std::max(errors.normal, right.normal_error(from + *answer * direction, out, 10 * tolerance));
  }
  return errors;
}

Scene rays_at(const std::string& name, const Geometry& geometry) {
  Scene scene;
  scene.group = "rays";
  scene.name = name;
  scene.in_bullet = false;
  scene.measure = [geometry](const WorldSettings& settings, const Make&,
                             bool quick) -> absl::StatusOr<Results> {
    const absl::StatusOr<Errors> errors = errors_of(settings, geometry, quick ? kQuickRays : kRays);
    if (!errors.ok()) return errors.status();
    const double rounding = rounding_of(settings);
    return Results{{"largest error of the place", "um", 0, errors->place * 1e6, rounding * 1e6},
                   {"largest error of the normal", "mrad", 0, errors->normal * 1e3, 1e3 * rounding * 1e3},
                   {"hit or missed wrongly", "", 0, static_cast<double>(errors->wrong), 0}};
  };
  return scene;
}

// An apex above a ring of 32 points, as cones of world files are.
ConvexHull cone() {
  ConvexHull hull{{{0, 0, 0.5}}};
  for (int n = 0; n < 32; ++n) {
    const double angle = 2 * std::numbers::pi * n / 32;
    hull.points.emplace_back(0.5 * std::cos(angle), 0.5 * std::sin(angle), -0.5);
  }
  return hull;
}

}  // namespace

std::vector<Scene> ray_scenes() {
  return {rays_at("box", Box{{1, 0.8, 0.6}}),
          rays_at("plate", Box{{1, 1, 0.01}}),
          rays_at("ball", Sphere{0.5}),
          rays_at("capsule", Capsule{0.3, 0.6}),
          rays_at("cylinder", Cylinder{0.5, 1}),
          rays_at("ellipsoid", Ellipsoid{{0.5, 0.3, 0.4}}),
          rays_at("stone", stone()),
          rays_at("cone", cone())};
}

}  // namespace tessera::truth
