// Springs, dampers, friction, servos and armatures of joints, beside what mechanics says of them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>

#include "lpss/engine/joint_scene.h"

namespace tessera::engine_tests {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kSpin = 1.0 / 6;       // kg m^2, of a link about its centre
constexpr double kReach = 0.5;          // m, from the axis of an arm to its centre
constexpr double kWeight = 9.81 * 0.5;  // N m, of an arm that is held out

struct Pace {
  double dt;
  int substeps;

  double step() const { return dt / substeps; }
  friend void PrintTo(const Pace& pace, std::ostream* out) {
    *out << std::lround(1 / pace.dt) << "HzBy" << pace.substeps;
  }
};

class PacedTest : public testing::TestWithParam<Pace> {
 protected:
  PacedTest() : engine_(test_engine(settings())), scene_(*engine_, GetParam().dt) {}

  static EngineSettings settings() {
    EngineSettings settings = test_settings();
    settings.substeps = GetParam().substeps;
    settings.adapt = false;
    return settings;
  }

  // From rest at 0 about 0.3, at this angular frequency (rad/s). Velocities lead positions by half a step:
  // angular frequency * step / 2 is the phase that this makes, and steps have a period that is longer by
  // (angular frequency * step)^2 / 12.
  static void expect_swing(JointScene& scene, std::size_t joint, double rate) {
    const double z = rate * step() * rate * step();
    double time = 0;
    for (int tick = 0; tick < std::lround(3 / GetParam().dt); ++tick) {
      scene.step();
      time += GetParam().dt;
      const double bound = 0.3 * (rate * step() / 2 + rate * time * z / 12 + z);
      ASSERT_NEAR(scene.joint_state(joint).position[0], 0.3 * (1 - std::cos(rate * time)), bound + 1e-4)
          << time;
    }
  }

  // A link of 1 kg that turns about its own centre, or slides, without gravity.
  std::size_t add_free(JointType type, std::uint64_t id = kLink) {
    scene_.add(ghost(id, {0, 0, 0}), 0, kNoGravity);
    return scene_.tie(type, 0, id, frame_at({0, 0, 0}, {0, 0, 1}));
  }

  double position(std::size_t joint = 0) const { return scene_.joint_state(joint).position[0]; }
  double velocity(std::size_t joint = 0) const { return scene_.joint_state(joint).velocity[0]; }
  static double step() { return GetParam().step(); }

  std::unique_ptr<Engine> engine_;
  JointScene scene_;
};

TEST_P(PacedTest, SpringSwingsByTheBook) {
  const double rate = 2 * pi;  // rad/s: a period of 1 s
  for (const JointType type : {JointType::kRevolute, JointType::kPrismatic}) {
    JointScene scene(*engine_, GetParam().dt);
    scene.add(ghost(kLink, {0, 0, 0}), 0, kNoGravity);
    const std::size_t joint = scene.tie(type, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
    const double mass = type == JointType::kRevolute ? kSpin : 1;
    scene.axis(joint).spring_stiffness = rate * rate * mass;
    scene.axis(joint).spring_reference = 0.3;
    expect_swing(scene, joint, rate);
  }
}

TEST_P(PacedTest, SpringKeepsItsEnergy) {
  const std::size_t joint = add_free(JointType::kRevolute);
  const double rate = 2 * pi;
  scene_.axis(joint).spring_stiffness = rate * rate * kSpin;
  scene_.axis(joint).spring_reference = 0.3;
  const auto widest = [&](double seconds) {
    double most = 0;
    for (int tick = 0; tick < std::lround(seconds / GetParam().dt); ++tick) {
      scene_.step();
      most = std::max(most, std::abs(position() - 0.3));
    }
    return most;
  };
  const double first = widest(5);
  widest(50);
  EXPECT_NEAR(widest(5), first, 2e-3 * first);
}

// The damper is implicit of the first order: decay by a rate that is less by the share of itself times half a
// step, and by a quarter of the square of the phase of a step.
TEST_P(PacedTest, DamperTakesTheSwingByTheBook) {
  const std::size_t joint = add_free(JointType::kRevolute);
  const double rate = 2 * pi;
  const double decay = 0.5;  // 1/s, of the amplitude
  scene_.axis(joint).spring_stiffness = rate * rate * kSpin;
  scene_.axis(joint).spring_reference = 0.3;
  scene_.axis(joint).damping = 2 * decay * kSpin;
  const double seconds = 4;
  scene_.run(seconds);
  double most = 0;
  for (int tick = 0; tick < std::lround(1 / GetParam().dt); ++tick) {
    scene_.step();
    most = std::max(most, std::abs(position() - 0.3));
  }
  // The widest of a period is one of its two ends, or what is sampled next to it.
  const double z = rate * step() * rate * step();
  const double slack = decay * seconds * (decay * step() + z / 4) + rate * step() / 2 + z;
  EXPECT_LT(most, 0.3 * std::exp(-decay * seconds) * (1 + slack));
  EXPECT_GT(most, 0.3 * std::exp(-decay * (seconds + 0.5)) * (1 - slack));
}

// Two equal masses in a row: a mode keeps its shape, so that both springs are solved at once.
TEST_P(PacedTest, SpringsInARowSwingInTheirMode) {
  const double stiffness = 100;  // N/m
  const double golden = (1 + std::sqrt(5.0)) / 2;
  BodyRecord near = ghost(kLink, {0, 0, 0});
  BodyRecord far = ghost(kLink + 1, {0, 0, 1});
  near.state.linear_velocity = {0, 0, 1};
  far.state.linear_velocity = {0, 0, golden};
  scene_.add(near, 0, kNoGravity);
  scene_.add(far, 0, kNoGravity);
  scene_.tie(JointType::kPrismatic, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
  scene_.tie(JointType::kPrismatic, kLink, kLink + 1, frame_at({0, 0, 0.5}, {0, 0, 1}));
  for (const std::size_t joint : {0u, 1u}) scene_.axis(joint).spring_stiffness = stiffness;
  const double rate = std::sqrt(stiffness) / golden;  // rad/s: 6.2
  const double amplitude = 1 / rate;
  for (int tick = 0; tick < std::lround(5 / GetParam().dt); ++tick) {
    scene_.step();
    const double z = rate * step() * rate * step();
    ASSERT_NEAR(position(1), position(0) * (golden - 1), amplitude * z + 1e-4);
    ASSERT_LT(std::abs(position(0)), amplitude * (1 + rate * step()) + 1e-4);
  }
}

TEST_P(PacedTest, SpringOfAnyStiffnessIsStable) {
  for (const double stiffness : {1e-6, 1e-2, 1.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e9, 1e12}) {
    JointScene scene(*engine_, GetParam().dt);
    scene.add(ghost(kLink, {kReach, 0, 0}));
    const std::size_t arm = scene.tie(JointType::kRevolute, 0, kLink, frame_at({0, 0, 0}, {0, -1, 0}));
    scene.axis(arm).spring_stiffness = stiffness;
    const double sag = kWeight / stiffness;
    for (int tick = 0; tick < std::lround(5 / GetParam().dt); ++tick) {
      scene.step();
      const JointState state = scene.joint_state(arm);
      // Nothing but the weight gives it energy: it falls by 1 m at most, on springs that hold by twice the
      // sag.
      ASSERT_LT(std::abs(state.velocity[0]), 1.1 * std::sqrt(4 * 9.81 * kReach / (kSpin + 0.25)))
          << stiffness;
      if (stiffness < 1e2) continue;
      ASSERT_LT(std::abs(state.position[0] + sag), 1.2 * sag + 2e-4) << stiffness;
    }
    if (stiffness < 1e6) continue;
    EXPECT_NEAR(scene.joint_state(arm).position[0], -sag, 0.1 * sag + 1e-4) << stiffness;
  }
}

TEST_P(PacedTest, FrictionHoldsForever) {
  scene_.add(ghost(kLink, {kReach, 0, 0}));
  const std::size_t arm = scene_.tie(JointType::kRevolute, 0, kLink, frame_at({0, 0, 0}, {0, -1, 0}));
  scene_.axis(arm).friction = 1.02 * kWeight;
  scene_.run(1);
  const double before = position();
  scene_.run(30);
  EXPECT_NEAR(position(), before, 1e-4);
}

TEST_P(PacedTest, FrictionLeavesTheRestOfAForce) {
  scene_.add(ghost(kLink, {0, 0, 0}));
  const std::size_t slide = scene_.tie(JointType::kPrismatic, 0, kLink, frame_at({0, 0, 0}, {0, 0, -1}));
  scene_.axis(slide).friction = 4;  // N, of a weight of 9.81 N
  scene_.run(1);
  EXPECT_NEAR(velocity(), 9.81 - 4, 1e-4);
}

TEST_P(PacedTest, ServoAnswersByTheBook) {
  const std::size_t joint = add_free(JointType::kRevolute);
  const double rate = 8;  // rad/s: critically damped
  scene_.drive(joint) = {DriveMode::kServo, 0.5, rate * rate * kSpin, 2 * rate * kSpin};
  double time = 0;
  for (int tick = 0; tick < std::lround(2 / GetParam().dt); ++tick) {
    scene_.step();
    time += GetParam().dt;
    const double exact = 0.5 * (1 - (1 + rate * time) * std::exp(-rate * time));
    ASSERT_NEAR(position(), exact, 0.5 * rate * step()) << time;
  }
  EXPECT_NEAR(position(), 0.5, 1e-3);
}

TEST_P(PacedTest, ServoSagsByItsStiffnessUnlessAnEffortBearsTheLoad) {
  for (const double effort : {0.0, kWeight}) {
    JointScene scene(*engine_, GetParam().dt);
    scene.add(ghost(kLink, {kReach, 0, 0}));
    const std::size_t arm = scene.tie(JointType::kRevolute, 0, kLink, frame_at({0, 0, 0}, {0, -1, 0}));
    scene.drive(arm) = {DriveMode::kServo, 0, 200, 20, 0, effort};
    scene.run(5);
    const double sag = scene.joint_state(arm).position[0];
    EXPECT_NEAR(200 * sag, effort - kWeight * std::cos(sag), 0.01) << effort;
  }
}

TEST_P(PacedTest, ServoReachesAVelocityByItsDampingAlone) {
  const std::size_t joint = add_free(JointType::kRevolute);
  JointDrive& drive = scene_.drive(joint);
  drive.mode = DriveMode::kServo;
  drive.damping = 3 * kSpin;  // N m s/rad: in 1/3 s
  drive.velocity = 2;
  scene_.run(1);
  EXPECT_NEAR(velocity(), 2 * (1 - std::exp(-3.0)), 2 * 3 * step());
}

TEST_P(PacedTest, ServoKeepsItsEffortMax) {
  const std::size_t joint = add_free(JointType::kRevolute);
  scene_.axis(joint).effort_max = 0.1;
  scene_.drive(joint) = {DriveMode::kServo, 3, 1e4, 1};
  scene_.run(0.5);
  EXPECT_NEAR(velocity(), 0.5 * 0.1 / kSpin, 1e-3);
}

TEST_P(PacedTest, ServoOfAnyGainsIsStable) {
  for (const double stiffness : {1.0, 1e3, 1e6, 1e12}) {
    for (const double damping : {0.0, 1.0, 1e3, 1e12}) {
      if (10 * damping > stiffness) continue;  // would take longer than this test
      JointScene scene(*engine_, GetParam().dt);
      scene.add(ghost(kLink, {kReach, 0, 0}));
      const std::size_t arm = scene.tie(JointType::kRevolute, 0, kLink, frame_at({0, 0, 0}, {0, -1, 0}));
      scene.drive(arm) = {DriveMode::kServo, 0.4, stiffness, damping};
      for (int tick = 0; tick < std::lround(5 / GetParam().dt); ++tick) {
        scene.step();
        ASSERT_LT(std::abs(scene.joint_state(arm).position[0]), pi);
      }
      if (stiffness < 1e6) continue;
      EXPECT_NEAR(scene.joint_state(arm).position[0], 0.4, 1e-3) << stiffness << " " << damping;
    }
  }
}

// (I + armature) a = effort
TEST_P(PacedTest, ArmatureAddsToTheInertiaOfAnAxis) {
  for (const JointType type : {JointType::kRevolute, JointType::kPrismatic}) {
    for (const double armature : {1e-6, 0.5, 1e6}) {
      JointScene scene(*engine_, GetParam().dt);
      scene.add(ghost(kLink, {0, 0, 0}), 0, kNoGravity);
      const std::size_t joint = scene.tie(type, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
      const double inertia = (type == JointType::kRevolute ? kSpin : 1) + armature;
      scene.axis(joint).armature = armature;
      scene.drive(joint) = {DriveMode::kEffort, 2 * inertia};
      scene.run(1);
      EXPECT_NEAR(scene.joint_state(joint).velocity[0], 2, 1e-4) << armature;
      scene.drive(joint) = {};
      scene.run(1);
      EXPECT_NEAR(scene.joint_state(joint).velocity[0], 2, 1e-4) << armature;
    }
  }
}

TEST_P(PacedTest, ArmatureSlowsASwing) {
  const std::size_t joint = add_free(JointType::kRevolute);
  const double rate = 2 * pi;
  scene_.axis(joint).armature = 2 * kSpin;
  scene_.axis(joint).spring_stiffness = rate * rate * 3 * kSpin;
  scene_.axis(joint).spring_reference = 0.3;
  expect_swing(scene_, joint, rate);
}

TEST_P(PacedTest, ArmatureSlowsAServo) {
  const std::size_t joint = add_free(JointType::kRevolute);
  const double inertia = 4 * kSpin;
  const double rate = 8;  // rad/s: critically damped
  scene_.axis(joint).armature = 3 * kSpin;
  scene_.drive(joint) = {DriveMode::kServo, 0.5, rate * rate * inertia, 2 * rate * inertia};
  double time = 0;
  for (int tick = 0; tick < std::lround(2 / GetParam().dt); ++tick) {
    scene_.step();
    time += GetParam().dt;
    const double exact = 0.5 * (1 - (1 + rate * time) * std::exp(-rate * time));
    ASSERT_NEAR(position(), exact, 0.5 * rate * step()) << time;
  }
}

// Two links that turn about a hinge between them while both turn across it.
TEST_P(PacedTest, ArmatureKeepsEnergyAndMomentum) {
  constexpr double kArmature = 0.4;
  BodyRecord first = ghost(kLink, {0, 0, 0});
  BodyRecord second = ghost(kLink + 1, {0, 0, 1});
  first.state.linear_velocity = {0, -0.3, 0};
  second.state.linear_velocity = {0, 0.3, 0};  // about x by 0.6 rad/s
  first.state.angular_velocity = {-0.6, 0, 1};
  second.state.angular_velocity = {-0.6, 0, -2};
  scene_.add(first, 0, kNoGravity);
  scene_.add(second, 0, kNoGravity);
  const std::size_t hinge =
      scene_.tie(JointType::kRevolute, kLink, kLink + 1, frame_at({0, 0, 0.5}, {0, 0, 1}));
  scene_.axis(hinge).armature = kArmature;
  struct Kept {
    double energy;
    Vector3d momentum;
    Vector3d turning;  // angular momentum
  };
  const auto look = [&] {
    const double rate = scene_.joint_state(hinge).velocity[0];
    Kept kept{kArmature * rate * rate / 2, Vector3d::Zero(), Vector3d::Zero()};
    for (const std::uint64_t id : {kLink, kLink + 1}) {
      const BodyState state = scene_.state(id);
      const Vector3d place(state.position.data());
      const Vector3d velocity(state.linear_velocity.data());
      const Vector3d spin(state.angular_velocity.data());
      kept.energy += (velocity.squaredNorm() + kSpin * spin.squaredNorm()) / 2;
      kept.momentum += velocity;
      kept.turning += place.cross(velocity) + kSpin * spin;
    }
    return kept;
  };
  scene_.step();
  const Kept before = look();
  scene_.run(10);
  const Kept after = look();
  EXPECT_NEAR(after.energy, before.energy, 0.01 * before.energy);
  EXPECT_LT((after.momentum - before.momentum).norm(), 1e-4);
  EXPECT_LT((after.turning - before.turning).norm(), 1e-2 * before.turning.norm());
  EXPECT_NEAR(scene_.joint_state(hinge).velocity[0], -3, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Paces, PacedTest,
                         testing::Values(Pace{1.0 / 60, 1}, Pace{1.0 / 60, 8}, Pace{1.0 / 240, 1},
                                         Pace{1.0 / 240, 8}),
                         testing::PrintToStringParamName());

// An angle without limits has many values; the spring takes the nearest to its reference.
TEST(SpringTest, PullsTheShortWay) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  BodyRecord link = ghost(kLink, {0, 0, 0});
  scene.add(link, 0, kNoGravity);
  const std::size_t hinge = scene.tie(JointType::kRevolute, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
  BodyState state = scene.state(kLink);
  state.rotation = rotation_of(Eigen::Quaterniond(Eigen::AngleAxisd(3.0, Vector3d::UnitZ())));
  scene.set_state(kLink, state);
  scene.axis(hinge).spring_stiffness = 1;
  scene.axis(hinge).spring_reference = -3;
  scene.axis(hinge).damping = 1;
  scene.step();
  EXPECT_GT(scene.joint_state(hinge).velocity[0], 0);
}

// Limits make an angle one number, and a reference beyond them preloads the spring.
TEST(SpringTest, PushesAgainstALimit) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  scene.add(ghost(kLink, {0, 0, 0}), 0, kNoGravity);
  const std::size_t hinge = scene.tie(JointType::kRevolute, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
  scene.axis(hinge).lower = -1;
  scene.axis(hinge).upper = 1;
  scene.axis(hinge).spring_stiffness = 1;
  scene.axis(hinge).spring_reference = 4;
  scene.run(5);
  EXPECT_NEAR(scene.joint_state(hinge).position[0], 1, 1e-3);
}

// So many driven axes have their rows once a tick.
TEST(ArmatureTest, CountsInEachStepOfLargeAssemblies) {
  EngineSettings settings = test_settings();
  settings.substeps = 8;
  const auto engine = test_engine(settings);
  JointScene scene(*engine);
  BodyRecord hub = ghost(kLink, {0, 0, 0});
  hub.properties.mass = 1e6;
  hub.properties.inertia = {1e6, 1e6, 1e6};
  scene.add(hub, 0, kNoGravity);
  constexpr std::size_t kArms = 260;
  for (std::size_t n = 0; n < kArms; ++n) {
    const std::uint64_t id = kLink + 1 + n;
    scene.add(ghost(id, {0, 0, 1}), 0, kNoGravity);
    const std::size_t joint = scene.tie(JointType::kUniversal, kLink, id, frame_at({0, 0, 1}, {0, 0, 1}));
    scene.joint(joint).axes[1].friction = 1e-3;
    scene.axis(joint).armature = 2 * kSpin;
    scene.drive(joint) = {DriveMode::kEffort, n % 2 == 0 ? 3 * kSpin : -3 * kSpin};
  }
  scene.run(0.2);
  EXPECT_NEAR(scene.joint_state(0).velocity[0], 0.2, 1e-4);
  EXPECT_NEAR(scene.joint_state(1).velocity[0], -0.2, 1e-4);
}

}  // namespace
}  // namespace tessera::engine_tests
