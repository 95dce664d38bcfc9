// Loops of joints: rows that follow from each other, and systems near to where they could not move at all.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "lpss/bullet/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

WorldSettings settings_of(double sector_size) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = bullet::test_precision;
  return settings;
}

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

// A Grashof four-bar, whose crank turns at 6 rad/s.
WorldDescription driven_four_bar(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  add_hinged(builder, {{0, 0, 3}, {0, 0, 2.5}, {1.5, 0, 2.2}, {1.5, 0, 3.2}}, 0.1, 5);
  builder.world().joints.front().drives[0] = {DriveMode::kVelocity, 6};
  return builder.world();
}

// A chain of planks between two posts that hangs through by about `sag` m, more on the right: it swings.
WorldDescription bridge(const WorldSettings& settings, double sag) {
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

WorldDescription hung_chain(const WorldSettings& settings) { return bridge(settings, 4); }
WorldDescription flat_bridge(const WorldSettings& settings) { return bridge(settings, 0); }

// 6 x 6 balls of 1 kg, half a metre apart, with a ball joint between neighbours; held at its corners, or
// along a side.
WorldDescription net(const WorldSettings& settings, bool at_corners) {
  constexpr int kSide = 6;
  constexpr double kMesh = 0.5;
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.1});
  const auto name = [](int i, int j) { return absl::StrCat("ball", i, "_", j); };
  const auto place = [](double i, double j) { return Vector3d(kMesh * i, kMesh * j, 0); };
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) builder.add(name(i, j), ball, 1, place(i, j));
  }
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const auto tie = [&](int di, int dj) {
        if (i + di == kSide || j + dj == kSide) return;
        builder.tie(absl::StrCat(name(i, j), "-", di), JointType::kBall, name(i, j), name(i + di, j + dj),
                    place(i + di / 2.0, j + dj / 2.0));
      };
      tie(1, 0);
      tie(0, 1);
      const bool is_held = at_corners ? i % (kSide - 1) == 0 && j % (kSide - 1) == 0 : i == 0;
      if (is_held)
        builder.tie(absl::StrCat("hook", i, "_", j), JointType::kBall, "", name(i, j), place(i, j));
    }
  }
  return builder.world();
}

WorldDescription flat_net(const WorldSettings& settings) { return net(settings, /*at_corners=*/true); }
WorldDescription curtain(const WorldSettings& settings) { return net(settings, /*at_corners=*/false); }

// What a world shows while it runs.
struct Moment {
  double energy = 0;  // J, of motion and height
  double moving = 0;  // J, of motion alone
  double gap = 0;     // m, the largest of a joint
};

JointSide side(const PartitionCluster& cluster, const WorldDescription& world, BodyId id) {
  if (id.value == 0) return {};
  const BodyRecord record = *cluster.body(id);
  return {{metres_between(world.anchor, record.home, world.settings.sector_size) +
               Vector3d(record.state.position.data()),
           quaternion_of(record.state)},
          Vector3d(record.state.linear_velocity.data()),
          Vector3d(record.state.angular_velocity.data())};
}

Moment look(const PartitionCluster& cluster, const WorldDescription& world) {
  constexpr double kGravity = 9.80665;
  // Velocities are those in the middle of the last step.
  const double half_step = world.settings.time_step / world.settings.substeps / 2;
  Moment now;
  for (std::uint64_t id = 1; id <= world.bodies.size(); ++id) {
    const BodyProperties& body = world.bodies[id - 1].properties;
    const JointSide at = side(cluster, world, BodyId{id});
    const Vector3d spin = at.pose.orientation.conjugate() * at.angular_velocity;
    now.moving += body.mass * at.linear_velocity.squaredNorm() / 2;
    now.moving += spin.cwiseAbs2().dot(Vector3d(body.inertia.data())) / 2;
    const double height = at.pose.position.z() - at.linear_velocity.z() * half_step;
    now.energy += body.mass * kGravity * height;
  }
  now.energy += now.moving;
  const std::vector<JointRecord> joints = joint_records_of(world).value();
  for (const JointRecord& joint : joints) {
    const JointState state = joint_state(joint.properties, side(cluster, world, joint.properties.parent),
                                         side(cluster, world, joint.properties.child));
    now.gap = std::max(now.gap, state.gap);
  }
  return now;
}

struct LoopCase {
  const char* name;
  WorldDescription (*world)(const WorldSettings&);
  int substeps;  // fixed; 0: as many as the world needs
  bool is_driven;

  WorldSettings settings() const {
    WorldSettings settings = settings_of(128);
    if (substeps > 0) {
      settings.substeps = substeps;
      settings.adapt = false;
    }
    return settings;
  }

  friend void PrintTo(const LoopCase& c, std::ostream* out) { *out << c.name << "Substeps" << c.substeps; }
};

std::vector<LoopCase> loop_cases() {
  std::vector<LoopCase> cases;
  for (const int substeps : {0, 1, 4, 64}) {
    cases.push_back({"FourBar", driven_four_bar, substeps, true});
    cases.push_back({"HungChain", hung_chain, substeps, false});
    cases.push_back({"FlatBridge", flat_bridge, substeps, false});
    cases.push_back({"FlatNet", flat_net, substeps, false});
    cases.push_back({"Curtain", curtain, substeps, false});
  }
  return cases;
}

class LoopTest : public testing::TestWithParam<LoopCase> {};

TEST_P(LoopTest, HoldsAndGainsNoEnergy) {
  const LoopCase& param = GetParam();
  const WorldDescription world = param.world(param.settings());
  auto cluster = cluster_of(world, 1);
  const double start = look(*cluster, world).energy;
  double moved = 0;
  double gap = 0;
  double gained = 0;
  constexpr int kTicks = 240;
  for (int tick = 0; tick < kTicks; ++tick) {
    cluster->step();
    const Moment now = look(*cluster, world);
    moved = std::max(moved, now.moving);
    gap = std::max(gap, now.gap);
    gained = std::max(gained, now.energy - start);
    ASSERT_TRUE(std::isfinite(now.energy)) << "tick " << tick;
  }
  RecordProperty("gap_mm", std::to_string(1000 * gap));
  RecordProperty("gained_J", std::to_string(gained));
  RecordProperty("moved_J", std::to_string(moved));
  EXPECT_LT(gap, param.substeps == 1 ? 0.05 : 0.002);
  if (!param.is_driven) {
    EXPECT_LT(gained, 0.01 * moved + 0.01);
  }
}

INSTANTIATE_TEST_SUITE_P(Loops, LoopTest, testing::ValuesIn(loop_cases()), testing::PrintToStringParamName());

TEST(Loops, TheMotorTurnsItsCrankForEver) {
  const WorldDescription world = driven_four_bar(settings_of(128));
  auto cluster = cluster_of(world, 1);
  for (int tick = 0; tick < 1200; ++tick) {
    cluster->step();
    if (tick < 60) continue;
    ASSERT_NEAR(side(*cluster, world, BodyId{1}).angular_velocity.norm(), 6, 0.01) << "tick " << tick;
  }
}

TEST(Loops, AreTheSameOnAnyNumberOfPartitions) {
  for (auto* const make : {hung_chain, flat_net, curtain}) {
    const WorldDescription world = make(settings_of(3));
    const std::vector<WorldHash> one = run(world, 1, 1, 120);
    EXPECT_EQ(first_difference(one, run(world, 2, 1, 120)), 120u);
    EXPECT_EQ(first_difference(one, run(world, 4, 2, 120)), 120u);
  }
}

}  // namespace
}  // namespace tessera
