#include "lpss/simulation/example_mechanisms.h"

#include <absl/strings/str_cat.h>

#include <random>
#include <string>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

void add_bar(WorldBuilder& builder, const std::string& name, const Vector3d& from, const Vector3d& to,
             double width, double mass) {
  const Vector3d along = to - from;
  const ShapeId shape = builder.shape(Box{{along.norm() - 0.02, width, 0.1}});
  builder.add(name, shape, mass, (from + to) / 2).pose.orientation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), along.normalized());
}

// Hinged bars from point to point, the first and the last hinge with the world.
void add_hinged(WorldBuilder& builder, const std::vector<Vector3d>& points, double width, double mass) {
  std::string last;
  for (std::size_t n = 0; n < points.size(); ++n) {
    std::string next;
    if (n + 1 < points.size())
      add_bar(builder, next = absl::StrCat("bar", n), points[n], points[n + 1], width, mass);
    const bool is_end = next.empty();
    builder.tie(absl::StrCat("hinge", n), JointType::kRevolute, is_end ? "" : last, is_end ? last : next,
                points[n], Vector3d::UnitY());
    last = next;
  }
}

}  // namespace

WorldDescription four_bar_world(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  add_hinged(builder, {{0, 0, 3}, {0, 0, 2.5}, {1.5, 0, 2.2}, {1.5, 0, 3.2}}, 0.1, 5);
  return builder.world();
}

WorldDescription bridge_world(const WorldSettings& settings, double sag) {
  constexpr int kPlanks = 10;
  WorldBuilder builder(settings);
  std::vector<Vector3d> points;
  for (int n = 0; n <= kPlanks; ++n) {
    const double x = n - kPlanks / 2.0;
    const double u = 2 * x / kPlanks;
    points.emplace_back(x, 0, -sag * (1 - u * u) * (1 + 0.3 * u));
  }
  add_hinged(builder, points, 1.5, 20);
  return builder.world();
}

WorldDescription net_world(const WorldSettings& settings, int side, bool at_corners) {
  constexpr double kMesh = 0.5;
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.1});
  const auto name = [](int i, int j) { return absl::StrCat("ball", i, "_", j); };
  const auto place = [](double i, double j) { return Vector3d(kMesh * i, kMesh * j, 0); };
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) builder.add(name(i, j), ball, 1, place(i, j));
  }
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const auto tie = [&](int di, int dj) {
        if (i + di == side || j + dj == side) return;
        builder.tie(absl::StrCat(name(i, j), "-", di), JointType::kBall, name(i, j), name(i + di, j + dj),
                    place(i + di / 2.0, j + dj / 2.0));
      };
      tie(1, 0);
      tie(0, 1);
      const bool is_held = at_corners ? i % (side - 1) == 0 && j % (side - 1) == 0 : i == 0;
      if (is_held)
        builder.tie(absl::StrCat("hook", i, "_", j), JointType::kBall, "", name(i, j), place(i, j));
    }
  }
  return builder.world();
}

WorldDescription tumbling_tree_world(const WorldSettings& settings, unsigned seed) {
  constexpr int kLinks = 8;
  std::mt19937 random(seed);
  const auto within = [&](double most) { return most * (2 * (random() / 4294967296.0) - 1); };
  const auto somewhere = [&](double most) {
    const double x = within(most);
    const double y = within(most);
    return Vector3d(x, y, within(most));
  };
  WorldBuilder builder(settings);
  const ShapeId shape = builder.shape(Box{{0.005, 0.01, 0.02}});
  std::string holder;
  for (int n = 0; n < kLinks; ++n) {
    const std::string name = absl::StrCat("link", n);
    const Vector3d centre = somewhere(0.15);
    BodyDescription& link = builder.add(name, shape, 0.5 + within(0.4), centre);
    link.pose.orientation = rotation_by(somewhere(2));
    link.properties.inertia = {1.5e-5, 1e-5, 0.7e-5};
    builder.tie(absl::StrCat("joint", n), JointType::kBall, holder, name, centre + somewhere(0.01));
    holder = absl::StrCat("link", random() % (static_cast<unsigned>(n) + 1));
  }
  return builder.world();
}

}  // namespace tessera
