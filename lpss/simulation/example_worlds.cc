#include "lpss/simulation/example_worlds.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/base/portable_math.h"

namespace tessera {
namespace {

// Principal moments of a homogeneous solid of unit mass.
struct Inertia {
  using Moments = std::array<double, 3>;

  static Moments of_box(const Eigen::Vector3d& size) {
    const Eigen::Vector3d s = size.cwiseAbs2() / 12;
    return {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()};
  }
  Moments operator()(const Box& box) const { return of_box(box.size); }
  Moments operator()(const Sphere& ball) const {
    const double moment = 0.4 * ball.radius * ball.radius;
    return {moment, moment, moment};
  }
  Moments operator()(const Cylinder& c) const {
    const double across = (3 * c.radius * c.radius + c.length * c.length) / 12;
    return {across, across, c.radius * c.radius / 2};
  }
  Moments operator()(const Capsule& c) const {
    return of_box({2 * c.radius, 2 * c.radius, c.length + 2 * c.radius});
  }
  template <typename Other>
  Moments operator()(const Other& other) const {
    return of_box(Eigen::Vector3d::Constant(bounding_radius(Geometry(other))));
  }
};

}  // namespace

ShapeId WorldBuilder::shape(Geometry geometry) {
  world_.shapes.push_back(Shape{{ShapePart{std::move(geometry), {}}}});
  return static_cast<ShapeId>(world_.shapes.size() - 1);
}

BodyDescription& WorldBuilder::add(const std::string& name, ShapeId shape, double mass,
                                   const Eigen::Vector3d& position, Motion motion) {
  BodyDescription body;
  body.name = name;
  body.properties.motion = motion;
  body.properties.shape = shape;
  body.properties.mass = mass;
  body.properties.inertia = std::visit(Inertia{}, world_.shapes.at(shape).parts.front().geometry);
  for (double& moment : body.properties.inertia) moment *= mass;
  const absl::StatusOr<WorldPosition> place = canonical(world_.anchor, position, world_.settings.sector_size);
  invariant(place.ok(), "example worlds stay within the range");
  body.pose.position = *place;
  world_.bodies.push_back(std::move(body));
  return world_.bodies.back();
}

std::size_t WorldBuilder::place_of(const std::string& body) const {
  const auto found = std::find_if(world_.bodies.begin(), world_.bodies.end(),
                                  [&](const BodyDescription& candidate) { return candidate.name == body; });
  invariant(found != world_.bodies.end(), "example worlds tie bodies that are there");
  return static_cast<std::size_t>(found - world_.bodies.begin());
}

JointDescription& WorldBuilder::tie(const std::string& name, JointType type, const std::string& parent,
                                    const std::string& child, const Eigen::Vector3d& position,
                                    const Eigen::Vector3d& axis) {
  const absl::StatusOr<WorldPosition> at = canonical(world_.anchor, position, world_.settings.sector_size);
  invariant(at.ok(), "example worlds stay within the range");
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), axis);
  const auto frame_in = [&](const BodyDescription& body) {
    const Pose pose{body.pose.position.local, body.pose.orientation};
    return pose.inverse() *
           Pose{relative_to(*at, body.pose.position.sector, world_.settings.sector_size), turn};
  };
  JointDescription joint;
  joint.name = name;
  joint.properties.type = type;
  const std::size_t child_place = place_of(child);
  joint.properties.child = BodyId{child_place + 1};
  joint.properties.in_child = frame_in(world_.bodies[child_place]);
  if (parent.empty()) {
    joint.properties.anchor = at->sector;
    joint.properties.in_parent = {at->local, turn};
  } else {
    const std::size_t parent_place = place_of(parent);
    joint.properties.parent = BodyId{parent_place + 1};
    joint.properties.in_parent = frame_in(world_.bodies[parent_place]);
  }
  world_.joints.push_back(std::move(joint));
  return world_.joints.back();
}

void WorldBuilder::add_floor(double half_size, double height) {
  const ShapeId floor = shape(Box{{2 * half_size, 2 * half_size, 2}});
  add(absl::StrCat("floor", world_.bodies.size()), floor, 1, {0, 0, height - 1}, Motion::kStatic);
}

std::string WorldBuilder::add_chain(int links, const Eigen::Vector3d& base, const Eigen::Vector3d& way) {
  const ShapeId link = shape(Capsule{0.05, kChainLink - 0.1});
  const Eigen::Quaterniond along = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), way);
  std::string last;
  for (int i = 0; i < links; ++i) {
    const std::string name = absl::StrCat("link", i);
    add(name, link, 1, base + (i + 0.5) * kChainLink * way).pose.orientation = along;
    tie(absl::StrCat("joint", i), JointType::kBall, last, name, base + i * kChainLink * way);
    last = name;
  }
  return last;
}

WorldDescription aboard(const MovingFrame& frame, WorldDescription world) {
  world.settings.frames.push_back(frame);
  const auto number = static_cast<FrameNumber>(world.settings.frames.size());
  for (BodyDescription& body : world.bodies) body.pose.position.sector.frame = number;
  for (JointDescription& joint : world.joints) joint.properties.anchor.frame = number;
  return world;
}

WorldDescription tower_world(const WorldSettings& settings, int count, const Eigen::Vector3d& base) {
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Box{{100, 100, 2}}), 1, base - Eigen::Vector3d(0, 0, 1),
              Motion::kStatic);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int i = 0; i < count; ++i) {
    builder.add(absl::StrCat("box", i), box, 1, base + Eigen::Vector3d(0.02 * ((i * 7) % 5 - 2), 0, i + 0.5));
  }
  return builder.world();
}

WorldDescription pyramid_world(const WorldSettings& settings, int rows) {
  WorldBuilder builder(settings);
  builder.add_floor(120, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int row = 0; row < rows; ++row) {
    for (int n = 0; n < rows - row; ++n) {
      builder.add(absl::StrCat("box", row, "_", n), box, 1,
                  {(n - (rows - row - 1) / 2.0) * 1.05, 0.0, 0.5 + row});
    }
  }
  return builder.world();
}

WorldDescription chain_world(const WorldSettings& settings, int links, const Eigen::Vector3d& base) {
  WorldBuilder builder(settings);
  builder.add_chain(links, base, Eigen::Vector3d::UnitX());
  return builder.world();
}

TriangleMesh hills(double half_size, double cell) {
  constexpr double kWaveNumber = 0.4;  // 1/m
  const auto cells = static_cast<std::uint32_t>(2 * half_size / cell);
  TriangleMesh mesh;
  for (std::uint32_t row = 0; row <= cells; ++row) {
    for (std::uint32_t column = 0; column <= cells; ++column) {
      const double x = column * cell - half_size;
      const double y = row * cell - half_size;
      mesh.vertices.emplace_back(
          x, y, 0.25 * (portable::sincos(kWaveNumber * x).sin + portable::sincos(kWaveNumber * y).sin));
    }
  }
  for (std::uint32_t row = 0; row < cells; ++row) {
    for (std::uint32_t column = 0; column < cells; ++column) {
      const std::uint32_t corner = row * (cells + 1) + column;
      const std::uint32_t above = corner + cells + 1;
      for (const std::uint32_t vertex : {corner, corner + 1, above + 1, corner, above + 1, above})
        mesh.indices.push_back(vertex);
    }
  }
  return mesh;
}

ConvexHull stone() {
  ConvexHull hull;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      hull.points.emplace_back(0.5 * x, 0.4 * y, -0.3);
      hull.points.emplace_back(0.3 * x, 0.25 * y, 0.3);
    }
  }
  return hull;
}

WorldDescription pile_world(const WorldSettings& settings, int count) {
  WorldBuilder builder(settings);
  const double corner = settings.sector_size / 2;
  builder.add("floor", builder.shape(Box{{200, 200, 2}}), 1, {corner, corner, corner - 2}, Motion::kStatic);
  const ShapeId shapes[] = {builder.shape(Box{{1, 1, 1}}), builder.shape(Sphere{0.5}),
                            builder.shape(Cylinder{0.5, 1}), builder.shape(Capsule{0.3, 0.6})};
  for (int i = 0; i < count; ++i) {
    const int layer = i / 12;
    const Eigen::Vector3d place(((i * 37) % 7 - 3) * 1.15 + 0.01 * (i % 5),
                                ((i * 53) % 6 - 2.5) * 1.15 + 0.013 * (i % 3), 0.3 + layer * 1.3);
    builder.add(absl::StrCat("body", i), shapes[i % 4], 1, Eigen::Vector3d(corner, corner, corner) + place);
  }
  return builder.world();
}

}  // namespace tessera
