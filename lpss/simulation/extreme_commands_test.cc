// Commands within their bounds, and at them: whatever they do, a tick has no broken invariant, and what it
// leaves is a state that can be read, from which a world goes on with the same bits.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/snapshot/world_snapshot.h"

namespace tessera {
namespace {

constexpr int kExtremeTicks = 40;
constexpr std::uint64_t kSeedsEach = 8;
constexpr double kExtremeSector = 16;  // m

WorldDescription crowded_world() {
  WorldSettings settings = sectors_of(kExtremeSector);
  settings.precision = engine_tests::test_precision;
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Plane{}), 0, {0, 0, 0}).properties.motion = Motion::kStatic;
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  const ShapeId ball = builder.shape(Sphere{0.5});
  for (int n = 0; n < 8; ++n) {
    const ShapeId shape = n % 2 == 0 ? box : ball;
    builder.add(absl::StrCat("body", n), shape, 1, {6.4 + 1.1 * (n % 4), 0.3, 0.5 + 1.1 * (n / 4)});
  }
  for (int n = 0; n < 2; ++n) {
    BodyDescription& lift = builder.add(absl::StrCat("lift", n), box, 1, {4.0 + 8 * n, 3, 0.5});
    lift.properties.motion = Motion::kKinematic;
  }
  return builder.world();
}

// Draws commands for the bodies 2 to 11, of which the last two are kinematic.
class Extremes {
 public:
  explicit Extremes(std::uint64_t seed) : random_(seed) {}

  std::vector<Command> commands() {
    std::vector<Command> list;
    for (std::uint64_t n = below(4); n > 0; --n) {
      if (std::optional<Command> command = any()) list.push_back(*std::move(command));
    }
    return list;
  }

 private:
  std::uint64_t below(std::uint64_t end) { return random_() % end; }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) / 9007199254740992.0;
  }
  // Some are at the bound, some are of any size below, some are usual.
  double size(double most) {
    switch (below(4)) {
      case 0:
        return most * 0.999;
      case 1:
        return most * std::pow(10.0, between(-12, 0));
      case 2:
        return between(0, 5);
      default:
        return 0;
    }
  }
  std::array<double, 3> vector(double most) {
    Eigen::Vector3d direction(between(-1, 1), between(-1, 1), between(-1, 1));
    if (below(3) == 0) direction = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(below(3)));
    direction = direction.normalized() * std::min(size(most), most);
    return {direction.x(), direction.y(), direction.z()};
  }
  BodyId body() { return BodyId{2 + below(10)}; }
  BodyId dynamic_body() { return BodyId{2 + below(8)}; }
  BodyId lift() { return BodyId{10 + below(2)}; }
  SectorIndex sector() {
    static constexpr std::array<std::int64_t, 6> kPlaces{0, 0, 1, -1, 3, std::int64_t{1} << 40};
    const auto place = [&] { return kPlaces[below(kPlaces.size())]; };
    const std::int64_t i = place();
    return {i, below(2) == 0 ? 0 : place(), 0};
  }
  BodyState state() {
    BodyState state;
    state.position = {between(-8, 8), between(-8, 8), between(-8, 8)};
    state.linear_velocity = vector(kSpeedMax);
    state.angular_velocity = vector(kAngularSpeedMax);
    return state;
  }

  std::optional<Command> any() {
    switch (below(10)) {
      case 0:
        return SetVelocity{body(), vector(kSpeedMax), vector(kAngularSpeedMax)};
      case 1:
        return ApplyImpulse{dynamic_body(), vector(kImpulseMax), vector(kLeverMax)};
      case 2:
        return ApplyForce{dynamic_body(), {vector(kForceMax), vector(kTorqueMax)}};
      case 3: {
        Teleport jump{body(), sector(), state()};
        jump.keeps_contacts = below(2) == 0;
        return jump;
      }
      case 4:
        return KinematicTarget{lift(), sector(), state()};
      case 5:
        return SetForce{dynamic_body(), LastingForce{{vector(kForceMax), vector(kTorqueMax)}, below(2) == 0}};
      case 6: {
        SetProperties change{dynamic_body(), {}};
        change.properties = records_[change.id.value - 2].properties;
        change.properties.mass = std::clamp(size(kMassMax), kMassMin, kMassMax);
        change.properties.friction = size(1e6);
        change.properties.restitution = between(0, 1);
        return change;
      }
      case 7:
        return ApplyRadialImpulse{sector(), {0, 0, 0}, 3 * kExtremeSector, size(kImpulseMax)};
      case 8:
        return joint();
      default:
        if (hinges_.empty()) return std::nullopt;
        return SetDrives{hinges_[below(hinges_.size())],
                         {JointDrive{DriveMode::kVelocity,
                                     below(2) == 0 ? size(kAngularSpeedMax) : -size(kAngularSpeedMax)},
                          {}}};
    }
  }
  // From a body, or the world, to one of the bodies that can be pushed.
  std::optional<Command> joint() {
    if (next_joint_ > 6) return std::nullopt;
    AddJoint addition;
    addition.record.id = JointId{next_joint_};
    JointProperties& properties = addition.record.properties;
    properties.type = below(2) == 0 ? JointType::kBall : JointType::kRevolute;
    properties.child = dynamic_body();
    const BodyId parent = body();
    if (parent == properties.child) return std::nullopt;
    properties.parent = parent;
    addition.record.parent_motion = parent.value >= 10 ? Motion::kKinematic : Motion::kDynamic;
    if (properties.type == JointType::kRevolute) hinges_.push_back(addition.record.id);
    ++next_joint_;
    return addition;
  }

 public:
  void know(const std::vector<BodyRecord>& records) { records_.assign(records.begin() + 1, records.end()); }

 private:
  std::mt19937_64 random_;
  std::uint64_t next_joint_ = 1;
  std::vector<JointId> hinges_;
  std::vector<BodyRecord> records_;
};

class ExtremeCommands : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(ExtremeCommands, LeaveAStateThatCanBeRead) {
  const WorldDescription world = crowded_world();
  for (std::uint64_t seed = GetParam(); seed < GetParam() + kSeedsEach; ++seed) {
    Extremes extremes(seed);
    extremes.know(records_of(world).value());
    const auto one = cluster_of(world, 1);
    auto two = cluster_of(world, 2);
    for (int tick = 0; tick < kExtremeTicks; ++tick) {
      SCOPED_TRACE(absl::StrCat("seed ", seed, ", tick ", tick));
      const std::vector<Command> commands = extremes.commands();
      one->step(commands);
      two->step(commands);
      ASSERT_EQ(one->hash(), two->hash());
      for (Rank rank = 0; rank < 2; ++rank) check_invariants(two->partition(rank));
      const WorldSnapshot snapshot = two->snapshot();
      ASSERT_TRUE(validate(snapshot).ok()) << validate(snapshot);
      if (tick % 8 == 7) {
        auto restored = PartitionCluster::restore(snapshot, 2);
        ASSERT_TRUE(restored.ok()) << restored.status();
        two = *std::move(restored);
        ASSERT_EQ(one->hash(), two->hash());
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, ExtremeCommands, ::testing::Range<std::uint64_t>(1, 33, kSeedsEach));

// A force that a body cannot follow: it is stopped each tick, and sleeps. While it was pressed it might have
// gone into the next sector, so that others heard of its island; then it cannot.
TEST(ExtremeForces, WhatTheyPressSleepsAndCanBeRestored) {
  const WorldDescription world = crowded_world();
  for (std::uint64_t pressed = 2; pressed <= 9; ++pressed) {
    const auto cluster = cluster_of(world, 2);
    const LastingForce force{{{-0.5 * kForceMax, 0, 93}, {8, 0.2 * kTorqueMax, 8}}, false};
    cluster->step(std::vector<Command>{SetForce{BodyId{pressed}, force}});
    for (int tick = 0; tick < 90; ++tick) {
      cluster->step();
      const auto restored = PartitionCluster::restore(cluster->snapshot(), 1);
      ASSERT_TRUE(restored.ok()) << restored.status() << ", body " << pressed << ", tick " << tick;
    }
  }
}

// What a torque does to a small ball in a tick is beyond the numbers of f32, and moves no point of it.
TEST(ExtremeForces, WhatTheyTurnBeyondAllNumbersCanBeRestored) {
  WorldBuilder builder(crowded_world().settings);
  const ShapeId ball = builder.shape(Sphere{1e-4});
  builder.add("ball", ball, kMassMin, {0.1 - kExtremeSector / 2, 0, 2});  // others know it
  const auto cluster = cluster_of(builder.world(), 2);
  cluster->step(std::vector<Command>{ApplyForce{BodyId{1}, {{}, {0, 0, kTorqueMax}}}});
  const WorldSnapshot snapshot = cluster->snapshot();
  EXPECT_TRUE(validate(snapshot).ok()) << validate(snapshot);
}

}  // namespace
}  // namespace tessera
