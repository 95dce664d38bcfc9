// Pairs that do not collide, whatever their shapes do: bodies that joints keep apart, and links of one
// assembly.

#include <gtest/gtest.h>

#include "lpss/engine/test_world.h"

namespace tessera::engine_tests {
namespace {

constexpr std::uint64_t kBox = 10;
constexpr std::uint64_t kBall = 11;
constexpr BodyId kFloorId{kFloor};
constexpr BodyId kBoxId{kBox};

class ApartTest : public testing::Test {
 protected:
  ApartTest() : engine_(test_engine(test_settings())), world_(*engine_) {
    world_.add(static_body(kFloor, kFloorShape, {0, 0, -1}));
  }

  void run(int ticks) {
    for (int tick = 0; tick < ticks; ++tick) world_.step();
  }

  std::unique_ptr<Engine> engine_;
  TestWorld world_;
};

TEST_F(ApartTest, BodiesPassEachOther) {
  engine_->set_apart(kBoxId, kFloorId, true);
  world_.add(dynamic_body(kBox, kBoxShape, {0, 0, 0.5}));
  run(60);
  EXPECT_TRUE(world_.world().contacts().empty());
  EXPECT_LT(world_.height(kBox), -3);
}

TEST_F(ApartTest, HoldsFromTheNextDetection) {
  world_.add(dynamic_body(kBox, kBoxShape, {0, 0, 0.5}));
  run(10);
  ASSERT_EQ(world_.world().contacts().size(), 1u);
  engine_->set_apart(kFloorId, kBoxId, true);
  world_.world().detect(1.0 / 60);
  EXPECT_TRUE(world_.world().contacts().empty());
  run(10);
  EXPECT_LT(world_.height(kBox), 0.45);
}

TEST_F(ApartTest, BodiesCollideAgainAfterIt) {
  engine_->set_apart(kFloorId, kBoxId, true);
  world_.add(dynamic_body(kBox, kBoxShape, {0, 0, 0.5}));
  run(5);
  engine_->set_apart(kBoxId, kFloorId, false);
  run(120);
  EXPECT_EQ(world_.world().contacts().size(), 1u);
  EXPECT_NEAR(world_.height(kBox), 0.5, 0.02);
}

TEST_F(ApartTest, OthersStillCollide) {
  engine_->set_apart(kFloorId, BodyId{99}, true);
  world_.add(dynamic_body(kBox, kBoxShape, {0, 0, 0.5}));
  run(60);
  EXPECT_NEAR(world_.height(kBox), 0.5, 0.02);
}

TEST_F(ApartTest, LastsAsLongAsOneJointAsksForIt) {
  world_.add(dynamic_body(kBox, kBoxShape, {0, 0, 0.5}));
  engine_->set_apart(kFloorId, kBoxId, true);
  engine_->set_apart(kFloorId, kBoxId, true);
  engine_->set_apart(kFloorId, kBoxId, false);
  run(1);
  EXPECT_TRUE(world_.world().contacts().empty());
  engine_->set_apart(kFloorId, kBoxId, false);
  run(1);
  EXPECT_EQ(world_.world().contacts().size(), 1u);
}

TEST_F(ApartTest, HoldsForSleepersToo) {
  world_.add(dynamic_body(kBox, kBoxShape, {0, 0, 0.5}));
  run(60);
  world_.world().sleep(world_.slot(kBox));
  engine_->set_apart(kFloorId, kBoxId, true);
  world_.world().detect(1.0 / 60);
  EXPECT_TRUE(world_.world().contacts().empty());
}

TEST_F(ApartTest, BringsNoContactsFromElsewhere) {
  world_.add(dynamic_body(kBox, kBoxShape, {0, 0, 0.5}));
  run(10);
  const ManifoldState contact = world_.world().export_manifold(0);
  engine_->set_apart(kFloorId, kBoxId, true);
  TestWorld elsewhere(*engine_);
  for (const auto& [id, record] : world_.records()) elsewhere.add(record);
  elsewhere.world().import_manifold(contact);
  EXPECT_TRUE(elsewhere.world().contacts().empty());
}

BodyRecord fast_ball(double height) {
  BodyRecord ball = dynamic_body(kBall, kSmallBallShape, {0, 0, height});
  ball.state.linear_velocity = {0, 0, -100};
  return ball;
}

TEST_F(ApartTest, SweepsPass) {
  engine_->set_apart(kFloorId, BodyId{kBall}, true);
  world_.add(fast_ball(2));
  run(12);
  EXPECT_LT(world_.height(kBall), -15);
}

TEST_F(ApartTest, LinksOfOneAssemblyPassEachOther) {
  BodyRecord box = dynamic_body(kBox, kBoxShape, {0, 0, 0.5});
  BodyRecord ball = fast_ball(4);
  box.properties.assembly = 7;
  ball.properties.assembly = 7;
  world_.add(box);
  world_.add(ball);
  run(4);
  // On the floor inside the box.
  EXPECT_NEAR(world_.height(kBall), 0.05, 0.02);
  EXPECT_NEAR(world_.height(kBox), 0.5, 0.02);
}

TEST_F(ApartTest, LinksOfTwoAssembliesCollide) {
  BodyRecord box = dynamic_body(kBox, kBoxShape, {0, 0, 0.5});
  BodyRecord ball = fast_ball(4);
  box.properties.assembly = 7;
  ball.properties.assembly = 8;
  world_.add(box);
  world_.add(ball);
  run(4);
  EXPECT_GT(world_.height(kBall), 0.9);
}

}  // namespace
}  // namespace tessera::engine_tests
