#include "lpss/tick/foresee.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lpss/partition/joints.h"
#include "lpss/partition/test_partition.h"

namespace tessera {
namespace {

constexpr double kTick = 1.0 / 64;         // s, as in test_settings()
const double kRadius = std::sqrt(3.) / 2;  // m, of a box
constexpr double kMobility = 6;            // 1/(kg m^2), of a box about its centre
constexpr double kMass = 1;                // kg
constexpr double kRounding = 1e-6;         // m
const Eigen::Vector3d kMiddle{1, 0, 0};    // m
const BodyState kMoves = moving(box(2, kHigh, kMiddle), {0, 0, 1}).state;

// Box 2 on a joint of box 1, or of the world.
class OnJoint {
 public:
  OnJoint(JointType type, bool on_world, const BodyState& state = box(2, kHigh, kMiddle).state,
          const SectorIndex& parents_home = kHigh) {
    joint_.id = JointId{1};
    joint_.properties.type = type;
    joint_.properties.parent = BodyId{on_world ? 0u : 1u};
    joint_.properties.child = BodyId{2};
    joint_.properties.anchor = kHigh;
    joint_.properties.in_parent.position = on_world ? kMiddle : Eigen::Vector3d(1, 0, 0);
    joint_.parent_motion = on_world ? Motion::kStatic : Motion::kDynamic;
    add_body(*partition_, box(1, parents_home, Eigen::Vector3d::Zero()));
    BodyRecord child = box(2, kHigh, kMiddle);
    child.state = state;
    add_body(*partition_, child);
  }

  JointAxis& axis() { return joint_.properties.axes[0]; }
  JointDrive& drive() { return joint_.drives[0]; }
  void add() { add_joint(*partition_, joint_); }
  void set_drive() { set_drives(*partition_, joint_.id, joint_.drives); }

  // m, in a tick in which nothing else happens.
  double surge(std::uint64_t id = 2) {
    const HomeBody& child = body(*partition_, id);
    child.sector->world->set_surge(child.slot, 0);
    foresee_drives(*partition_);
    return child.sector->world->surge(child.slot);
  }

 private:
  TestPartition partition_;
  JointRecord joint_;
};

TEST(Foresee, AnEffortActsAllTheTick) {
  OnJoint slider(JointType::kPrismatic, /*on_world=*/true);
  slider.drive() = {.mode = DriveMode::kEffort, .target = -10};
  slider.add();
  EXPECT_NEAR(slider.surge(), 10 / kMass * kTick * kTick, kRounding);
  EXPECT_EQ(slider.surge(1), 0) << "what no joint holds has none";

  OnJoint hinge(JointType::kRevolute, /*on_world=*/true);
  hinge.drive() = {.mode = DriveMode::kEffort, .target = 10};
  hinge.axis().effort_max = 1;
  hinge.add();
  EXPECT_NEAR(hinge.surge(), kMobility * kTick * kTick * kRadius, kRounding);
}

TEST(Foresee, ADriveDoesNoMoreThanItWants) {
  OnJoint slider(JointType::kPrismatic, /*on_world=*/true, kMoves);
  slider.drive() = {.mode = DriveMode::kVelocity, .target = 2};
  slider.add();
  EXPECT_NEAR(slider.surge(), 2 * kTick, kRounding);
  slider.drive() = {.mode = DriveMode::kServo, .target = 0.01, .stiffness = 1e9};
  slider.set_drive();
  EXPECT_LE(slider.surge(), 0.01 + kTick);
  slider.drive() = {.mode = DriveMode::kServo, .target = 0, .stiffness = 100};
  slider.set_drive();
  EXPECT_LT(slider.surge(), kTick * 0.1) << "it is where it wants to be";
}

TEST(Foresee, OnABodyThatMayMoveADriveActsInTheTickInWhichItIsSet) {
  OnJoint slider(JointType::kPrismatic, /*on_world=*/false, kMoves);
  slider.axis().lower = -0.5;
  slider.axis().upper = 0.5;
  slider.drive() = {.mode = DriveMode::kServo, .target = 0.25, .stiffness = 100};
  slider.add();
  EXPECT_EQ(slider.surge(), 0);
  slider.set_drive();
  EXPECT_NEAR(slider.surge(), 100 * 0.25 / kMass * kTick * kTick, kRounding);
  EXPECT_EQ(slider.surge(), 0) << "in that tick alone";
  slider.drive() = {.mode = DriveMode::kEffort, .target = 10};
  slider.set_drive();
  EXPECT_NEAR(slider.surge(), 10 / kMass * kTick * kTick, kRounding);
  EXPECT_NEAR(slider.surge(), 10 / kMass * kTick * kTick, kRounding);
}

TEST(Foresee, OnABodyOfAnotherSectorABoundTakesThePlaceOfTheAxis) {
  OnJoint slider(JointType::kPrismatic, /*on_world=*/false, kMoves, kLow);
  slider.axis().lower = -0.5;
  slider.axis().upper = 0.5;
  slider.drive() = {.mode = DriveMode::kServo, .target = 0.25, .stiffness = 100};
  slider.add();
  slider.set_drive();
  EXPECT_NEAR(slider.surge(), 100 * 1 / kMass * kTick * kTick, kRounding);
}

TEST(Foresee, NoSurgeIsLargerThanTheLargest) {
  OnJoint slider(JointType::kPrismatic, /*on_world=*/true);
  slider.drive() = {.mode = DriveMode::kEffort, .target = 1e9};
  slider.add();
  EXPECT_EQ(slider.surge(), kSurgeMax);
}

}  // namespace
}  // namespace tessera
