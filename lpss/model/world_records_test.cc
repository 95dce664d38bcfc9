// Joints that are described in body frames are simulated in centre frames, at the same place.
#include "lpss/model/world_records.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace tessera {
namespace {

using testing::HasSubstr;

// A box whose centre of mass and principal axes are not those of its body frame, kinematic and static ones
// like it.
WorldDescription three_bodies() {
  WorldDescription world;
  world.shapes = {Shape{{{Box{}, Pose{}}}}};
  BodyDescription body;
  body.properties.centre = {0.25, 0, -0.5};
  body.properties.principal_axes = {0, 0, std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2};
  for (const Motion motion : {Motion::kDynamic, Motion::kKinematic, Motion::kStatic}) {
    body.name = std::to_string(static_cast<int>(motion));
    body.properties.motion = motion;
    world.bodies.push_back(body);
  }
  return world;
}

JointDescription joint_to(BodyId parent) {
  JointDescription joint;
  joint.name = "joint_" + std::to_string(parent.value);
  joint.properties.type = JointType::kRevolute;
  joint.properties.parent = parent;
  joint.properties.child = BodyId{1};
  joint.properties.in_parent.position = {1, 2, 3};
  joint.properties.in_child.position = {1, 2, 3};
  joint.drives[0] = {DriveMode::kVelocity, 2};
  return joint;
}

Pose placed(const BodyRecord& record, const Pose& in_centre) {
  return Pose{Eigen::Vector3d(record.state.position.data()), quaternion_of(record.state)} * in_centre;
}

TEST(JointRecords, StandWhereTheDescriptionSays) {
  WorldDescription world = three_bodies();
  world.joints = {joint_to({}), joint_to(BodyId{2}), joint_to(BodyId{3})};
  const auto bodies = records_of(world);
  const auto joints = joint_records_of(world);
  ASSERT_TRUE(bodies.ok()) << bodies.status();
  ASSERT_TRUE(joints.ok()) << joints.status();
  ASSERT_EQ(joints->size(), 3u);
  for (std::size_t n = 0; n < 3; ++n) {
    const JointRecord& joint = (*joints)[n];
    EXPECT_EQ(joint.id, JointId{n + 1});
    EXPECT_EQ(joint.drives, world.joints[n].drives);
    const Pose child = placed((*bodies)[0], joint.properties.in_child);
    EXPECT_LT((child.position - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
    EXPECT_LT(child.orientation.angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
    const std::uint64_t parent = joint.properties.parent.value;
    const Pose in_world =
        parent == 0 ? joint.properties.in_parent : placed((*bodies)[parent - 1], joint.properties.in_parent);
    EXPECT_LT((in_world.position - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
    EXPECT_LT(in_world.orientation.angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
  }
  EXPECT_EQ((*joints)[0].parent_motion, Motion::kStatic);
  EXPECT_EQ((*joints)[1].parent_motion, Motion::kKinematic);
  EXPECT_EQ((*joints)[2].parent_motion, Motion::kStatic);
}

TEST(JointRecords, APlaceInTheWorldIsCanonical) {
  WorldDescription world = three_bodies();
  world.bodies[0].pose.position.sector = {7, 0, 0};
  world.joints = {joint_to({})};
  world.joints[0].properties.anchor = {5, 0, 0};
  world.joints[0].properties.in_parent.position = {2 * world.settings.sector_size, 0, 0};
  const auto joints = joint_records_of(world);
  ASSERT_TRUE(joints.ok()) << joints.status();
  EXPECT_EQ(joints->front().properties.anchor, (SectorIndex{7, 0, 0}));
  EXPECT_EQ(joints->front().properties.in_parent.position, Eigen::Vector3d::Zero());
}

TEST(JointRecords, RefuseWhatIsNotValid) {
  WorldDescription world = three_bodies();
  world.joints = {joint_to(BodyId{4})};
  EXPECT_THAT(std::string(joint_records_of(world).status().message()),
              HasSubstr("joint 'joint_4': parent = 4"));
}

}  // namespace
}  // namespace tessera
