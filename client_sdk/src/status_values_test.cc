// Poses of frames, and how divergence is told.
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <numbers>

#include "tessera/client.h"

namespace tessera {
namespace {

TEST(Frames, GoWithTheirBodies) {
  const double right_angle = std::numbers::pi / 2;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(right_angle, Eigen::Vector3d::UnitZ()));
  FoundFrame frame{"arm::tool", BodyId{1}, "arm::hand", {{2, 0, 1}, turn}};
  BodySample hand;
  hand.pose = {{{5, 0, 0}, {7, 7, 0}}, turn};
  const WorldPose pose = frame_pose(frame, hand, 16);
  EXPECT_EQ(pose.position.sector, (SectorIndex{5, 1, 0})) << "it reaches into the next sector";
  EXPECT_LT((pose.position.local - Eigen::Vector3d(7, -7, 1)).norm(), 1e-12);
  EXPECT_LT(pose.orientation.angularDistance(turn * turn), 1e-12);
}

TEST(Frames, StayWithTheirBodiesAtTheLastSector) {
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  const FoundFrame frame{"arm::tool", BodyId{1}, "arm::hand", {{5, 0, 0}, Eigen::Quaterniond::Identity()}};
  BodySample hand;
  hand.pose.position = {{kLast, 0, 0}, {7, 0, 0}};
  const WorldPose pose = frame_pose(frame, hand, 16);
  EXPECT_EQ(pose.position.sector.i, kLast);
  EXPECT_EQ(pose.position.local.x(), 12);
}

TEST(Divergences, AreToldByName) {
  NamedDivergence divergence{{12, BodyId{7}, JointId{}, DivergenceKind::kSpeed}, "arm::link", ""};
  EXPECT_EQ(to_text(divergence), "body 'arm::link' at tick 12: speed above 1e+06 m/s");
  divergence.joint = JointId{3};
  divergence.body_name.clear();
  divergence.joint_name = "arm::elbow";
  EXPECT_EQ(to_text(divergence), "body 7 at tick 12: speed above 1e+06 m/s, joint 'arm::elbow'");
}

}  // namespace
}  // namespace tessera
