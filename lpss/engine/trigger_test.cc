// What overlaps a trigger, of every kind of shape, in a world alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "lpss/engine/test_world.h"

namespace tessera::engine_tests {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::uint64_t kSensor = 10;
constexpr std::uint64_t kGuest = 20;
const Overlap kIn{BodyId{kSensor}, BodyId{kGuest}};

EngineSettings weightless() {
  EngineSettings settings = test_settings();
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  return settings;
}

BodyRecord as_trigger(BodyRecord record) {
  record.properties.trigger = true;
  return record;
}

BodyRecord kinematic(BodyRecord record) {
  record.properties.motion = Motion::kKinematic;
  return record;
}

class TriggerTest : public ::testing::Test {
 protected:
  TriggerTest() : engine_(test_engine(weightless())) { add_test_shapes(*engine_); }

  // What a world of these two says at once.
  std::vector<Overlap> overlaps(const BodyRecord& sensor, const BodyRecord& guest) {
    TestWorld world(*engine_);
    world.add(sensor);
    world.add(guest);
    return overlaps(world);
  }
  static std::vector<Overlap> overlaps(TestWorld& world, const std::vector<Overlap>& before = {}) {
    world.world().detect(kTick);
    std::vector<Overlap> now;
    world.world().find_overlaps(before, now);
    return now;
  }

  std::unique_ptr<Engine> engine_;
};

TEST_F(TriggerTest, EveryConvexShapeNoticesEveryOther) {
  for (ShapeId a = 0; a < kDynamicShapes; ++a) {
    for (ShapeId b = 0; b < kDynamicShapes; ++b) {
      // Compounds have a hole in their middle.
      bool was_in = false;
      bool has_left = false;
      for (double x = 0; x < 4; x += 0.125) {
        const bool is_in = !overlaps(as_trigger(dynamic_body(kSensor, a, {0.01, 0, 0})),
                                     dynamic_body(kGuest, b, {x, 0.02, 0.03}))
                                .empty();
        const bool is_in_other = !overlaps(as_trigger(dynamic_body(kSensor, b, {x, 0.02, 0.03})),
                                           dynamic_body(kGuest, a, {0.01, 0, 0}))
                                      .empty();
        EXPECT_EQ(is_in, is_in_other) << a << " and " << b << " at " << x;
        has_left |= was_in && !is_in;
        was_in = is_in;
      }
      EXPECT_TRUE(has_left) << a << " and " << b;
      EXPECT_FALSE(was_in) << a << " and " << b;
    }
  }
}

TEST_F(TriggerTest, ABoxAndABallOverlapWhereTheyDo) {
  for (const double gap : {1e-3, -1e-3}) {
    const Eigen::Vector3d place =
        Eigen::Vector3d(0.5, 0.5, 0.5) + Eigen::Vector3d::Ones().normalized() * (0.5 + gap);
    const std::vector<Overlap> found = overlaps(as_trigger(static_body(kSensor, kBoxShape, {0, 0, 0})),
                                                dynamic_body(kGuest, kSphereShape, place));
    EXPECT_EQ(found.size(), gap < 0 ? 1u : 0u) << gap;
  }
}

TEST_F(TriggerTest, SurfacesAndPlanesAreNoticedAndNotice) {
  for (const ShapeId ground :
       {kFloorShape, kPlaneShape, kMeshShape, kHeightFieldShape, kCompoundFloorShape}) {
    const double top = ground == kFloorShape ? 1 : ground == kHeightFieldShape ? 0.5 : 0;
    for (ShapeId shape = 0; shape < kDynamicShapes; ++shape) {
      for (const double gap : {0.02, -0.02}) {
        const Eigen::Vector3d place(0.3, 0.2, top + resting_height(shape) + gap);
        const BodyRecord still = static_body(kSensor, ground, {0, 0, 0});
        const BodyRecord moving = dynamic_body(kGuest, shape, place);
        EXPECT_EQ(overlaps(as_trigger(still), moving).size(), gap < 0 ? 1u : 0u)
            << ground << " notices " << shape << " at " << gap;
        BodyRecord sensor = as_trigger(moving);
        sensor.id = BodyId{kSensor};
        BodyRecord guest = still;
        guest.id = BodyId{kGuest};
        EXPECT_EQ(overlaps(sensor, guest).size(), gap < 0 ? 1u : 0u)
            << shape << " notices " << ground << " at " << gap;
      }
    }
  }
}

TEST_F(TriggerTest, OneOfTheTwoBodiesMustBeAbleToMove) {
  const BodyRecord dynamic = dynamic_body(kGuest, kBoxShape, {0.5, 0, 0});
  const BodyRecord still = static_body(kGuest, kBoxShape, {0.5, 0, 0});
  for (const BodyRecord& sensor :
       {dynamic_body(kSensor, kBoxShape, {0, 0, 0}), kinematic(dynamic_body(kSensor, kBoxShape, {0, 0, 0})),
        static_body(kSensor, kBoxShape, {0, 0, 0})}) {
    const bool moves = sensor.properties.motion != Motion::kStatic;
    EXPECT_THAT(overlaps(as_trigger(sensor), dynamic), ElementsAre(kIn));
    EXPECT_THAT(overlaps(as_trigger(sensor), kinematic(dynamic)), ElementsAre(kIn));
    EXPECT_EQ(overlaps(as_trigger(sensor), still).size(), moves ? 1u : 0u);
  }
}

TEST_F(TriggerTest, TriggersAssembliesBitsAndPairsKeptApartDoNotCount) {
  const BodyRecord sensor = as_trigger(dynamic_body(kSensor, kBoxShape, {0, 0, 0}));
  const BodyRecord guest = dynamic_body(kGuest, kBoxShape, {0.5, 0, 0});
  EXPECT_THAT(overlaps(sensor, guest), ElementsAre(kIn));
  EXPECT_THAT(overlaps(sensor, as_trigger(guest)), IsEmpty());
  const auto with = [&](const auto& change) {
    BodyRecord a = sensor;
    BodyRecord b = guest;
    change(a.properties, b.properties);
    return overlaps(a, b);
  };
  EXPECT_THAT(with([](auto& a, auto& b) { a.assembly = b.assembly = 7; }), IsEmpty());
  EXPECT_THAT(with([](auto& a, auto& b) { a.assembly = 7, b.assembly = 8; }), ElementsAre(kIn));
  EXPECT_THAT(with([](auto& a, auto&) { a.mask = 2; }), IsEmpty());
  EXPECT_THAT(with([](auto&, auto& b) { b.mask = 2; }), IsEmpty());
  EXPECT_THAT(with([](auto& a, auto& b) { a.mask = 2, b.category = 2; }), ElementsAre(kIn));
  engine_->set_apart(BodyId{kSensor}, BodyId{kGuest}, true);
  EXPECT_THAT(overlaps(sensor, guest), IsEmpty());
  engine_->set_apart(BodyId{kSensor}, BodyId{kGuest}, false);
}

TEST_F(TriggerTest, ATriggerTouchesNothingAndNoQueryMeetsIt) {
  TestWorld world(*engine_);
  world.add(as_trigger(dynamic_body(kSensor, kBoxShape, {0, 0, 0})));
  world.add(dynamic_body(kGuest, kBoxShape, {0.5, 0, 0}));
  EXPECT_THAT(overlaps(world), ElementsAre(kIn));
  EXPECT_THAT(world.world().contacts(), IsEmpty());
  world.remove(kGuest);
  EXPECT_FALSE(world.world().raycast({-3, 0, 0}, {3, 0, 0}, {}).has_value());
  EXPECT_THAT(world.world().raycast_all({-3, 0, 0}, {3, 0, 0}, {}), IsEmpty());
  EXPECT_THAT(world.world().near(Sphere{1}, {}, 1, {}), IsEmpty());
  EXPECT_FALSE(
      world.world().sweep(Sphere{0.5}, {{-3, 0, 0}, Eigen::Quaterniond::Identity()}, {1, 0, 0}, 6, {}));
  EXPECT_THAT(overlaps(world, {kIn}), IsEmpty());
}

// A solid core with a shell that notices.
TEST_F(TriggerTest, APartMayBeATrigger) {
  PartMaterial notices;
  notices.trigger = true;
  const ShapeId id = 100;
  engine_->add_shape(id, Shape{{ShapePart{Sphere{0.25}, {}}, ShapePart{Sphere{2}, {}, notices}}});
  TestWorld world(*engine_);
  world.add(dynamic_body(kSensor, id, {0, 0, 0}));
  world.add(dynamic_body(kGuest, kSmallBallShape, {1, 0, 0}));
  EXPECT_THAT(overlaps(world), ElementsAre(kIn));
  EXPECT_THAT(world.world().contacts(), IsEmpty());
  EXPECT_NEAR(world.world().raycast({-3, 0, 0}, {3, 0, 0}, {})->fraction, 2.75 / 6, 1e-6);
  EXPECT_EQ(world.world().swept_box(world.slot(kSensor), kTick).sizes().x(),
            world.world().swept_box(world.slot(kSensor), kTick).sizes().z());
  EXPECT_LT(world.world().swept_box(world.slot(kSensor), kTick).sizes().x(), 1);
}

// Whatever hides in a shape that has parts of its own bits.
TEST_F(TriggerTest, PartsHaveBitsOfTheirOwn) {
  PartMaterial notices;
  notices.trigger = true;
  notices.mask = 2;
  PartMaterial seen;
  seen.category = 2;
  engine_->add_shape(100, Shape{{ShapePart{Sphere{0.25}, {}}, ShapePart{Sphere{2}, {}, notices}}});
  engine_->add_shape(101, Shape{{ShapePart{Sphere{0.1}, {{0, 0, 0}, Eigen::Quaterniond::Identity()}},
                                 ShapePart{Sphere{0.1}, {{1, 0, 0}, Eigen::Quaterniond::Identity()}, seen}}});
  EXPECT_THAT(overlaps(dynamic_body(kSensor, 100, {0, 0, 0}), dynamic_body(kGuest, 101, {1.95, 0, 0})),
              IsEmpty());
  EXPECT_THAT(overlaps(dynamic_body(kSensor, 100, {0, 0, 0}), dynamic_body(kGuest, 101, {1, 0, 0})),
              ElementsAre(kIn));
}

TEST_F(TriggerTest, WhatGoesFarIsNoticedOnItsWay) {
  const ShapeId sheet = 100;
  engine_->add_shape(sheet, Shape{{ShapePart{Box{{1e-3, 4, 4}}, {}}}});
  BodyRecord bullet = dynamic_body(kGuest, kSmallBallShape, {-1.5, 0.1, 0.2});
  bullet.state.linear_velocity = {200, 0, 0};
  const BodyRecord gate = as_trigger(static_body(kSensor, sheet, {0, 0, 0}));
  EXPECT_THAT(overlaps(gate, bullet), ElementsAre(kIn));
  bullet.state.position[1] = 2.2;  // beside it
  EXPECT_THAT(overlaps(gate, bullet), IsEmpty());
  bullet.state.position = {-3.5, 0, 0};  // not there yet
  EXPECT_THAT(overlaps(gate, bullet), IsEmpty());
  // A gate that goes by, and both.
  for (const double share : {0.0, 0.5, 1.0}) {
    BodyRecord target = dynamic_body(kGuest, kSmallBallShape, {-1.5, 0, 0});
    target.state.linear_velocity = {200 * share, 0, 0};
    BodyRecord moving = kinematic(as_trigger(dynamic_body(kSensor, sheet, {0, 0, 0})));
    moving.state.linear_velocity = {-200 * (1 - share), 0, 0};
    EXPECT_THAT(overlaps(moving, target), ElementsAre(kIn)) << share;
    EXPECT_THAT(overlaps(moving, kinematic(target)), ElementsAre(kIn)) << share;
  }
}

TEST_F(TriggerTest, WhatIsStoppedDoesNotGetBehindTheObstacle) {
  const ShapeId sheet = 100;
  engine_->add_shape(sheet, Shape{{ShapePart{Box{{1e-3, 4, 4}}, {}}}});
  for (const double wall : {-0.6, 0.6}) {
    TestWorld world(*engine_);
    world.add(as_trigger(static_body(kSensor, sheet, {0, 0, 0})));
    world.add(static_body(11, sheet, {wall, 0, 0}));
    BodyRecord bullet = dynamic_body(kGuest, kSmallBallShape, {-1.5, 0.1, 0.2});
    bullet.state.linear_velocity = {200, 0, 0};
    world.add(bullet);
    EXPECT_EQ(overlaps(world).size(), wall < 0 ? 0u : 1u) << wall;
  }
}

TEST_F(TriggerTest, ClonesMeetWhatLivesHere) {
  const BodyRecord sensor = as_trigger(dynamic_body(kSensor, kBoxShape, {0, 0, 0}));
  const BodyRecord guest = dynamic_body(kGuest, kBoxShape, {0.5, 0, 0});
  const auto found = [&](const BodyRecord& a, Role role_a, const BodyRecord& b, Role role_b) {
    TestWorld world(*engine_);
    world.add(a, role_a);
    world.add(b, role_b);
    return overlaps(world).size();
  };
  EXPECT_EQ(found(sensor, Role::kClone, guest, Role::kHome), 1u);
  EXPECT_EQ(found(sensor, Role::kHome, guest, Role::kClone), 1u);
  EXPECT_EQ(found(sensor, Role::kClone, guest, Role::kClone), 0u);
  // The home of the dynamic one looks.
  EXPECT_EQ(found(kinematic(sensor), Role::kHome, guest, Role::kClone), 0u);
  EXPECT_EQ(found(kinematic(sensor), Role::kClone, guest, Role::kHome), 1u);
  EXPECT_EQ(found(kinematic(sensor), Role::kHome, kinematic(guest), Role::kClone), 1u);
  EXPECT_EQ(found(as_trigger(static_body(kSensor, kBoxShape, {0, 0, 0})), Role::kStatic, guest, Role::kClone),
            0u);
}

TEST_F(TriggerTest, AHugeBallIsExact) {
  const ShapeId zone = 100;
  engine_->add_shape(zone, Shape{{ShapePart{Sphere{6.371e6}, {}}}});
  for (const double gap : {0.01, -0.01}) {
    EXPECT_EQ(overlaps(as_trigger(static_body(kSensor, zone, {0, 0, -6.371e6})),
                       dynamic_body(kGuest, kBoxShape, {0, 0, 0.5 + gap}))
                  .size(),
              gap < 0 ? 1u : 0u)
        << gap;
  }
}

}  // namespace
}  // namespace tessera::engine_tests
