// The bits of an engine world are a function of its bodies and contacts, not of how it came to be.

#include <gtest/gtest.h>

#include <thread>

#include "lpss/engine/test_world.h"

namespace tessera::engine_tests {
namespace {

constexpr int kTicks = 600;

struct Pile {
  const char* name;
  std::vector<ShapeId> shapes;
  ShapeId floor;
  double sleep_after;
  int bodies = 120;
  double spread = 1;  // of the positions
  double speed = 0;   // m/s, down and to the side
};

void PrintTo(const Pile& pile, std::ostream* out) { *out << pile.name; }

BodyRecord pile_body(const Pile& pile, int i) {
  const ShapeId shape = pile.shapes[static_cast<std::size_t>(i) % pile.shapes.size()];
  const int row = i / 20;
  const Eigen::Vector3d place(((i * 37) % 7) * 1.15 + 0.01 * (i % 5), ((i * 53) % 6) * 1.15 + 0.013 * (i % 3),
                              0.8 + row * 1.3);
  BodyRecord record = dynamic_body(static_cast<std::uint64_t>(i) + 10, shape, place * pile.spread);
  record.state.linear_velocity = {pile.speed * ((i % 3) - 1), pile.speed * ((i % 4) - 1.5) / 2, -pile.speed};
  return record;
}

TestWorld pile_world(Engine& engine, const Pile& pile, bool backwards = false) {
  TestWorld world(engine);
  if (!backwards) world.add(static_body(kFloor, pile.floor, {0, 0, pile.floor == kFloorShape ? -1.0 : 0.0}));
  for (int k = 0; k < pile.bodies; ++k) world.add(pile_body(pile, backwards ? pile.bodies - 1 - k : k));
  if (backwards) world.add(static_body(kFloor, pile.floor, {0, 0, pile.floor == kFloorShape ? -1.0 : 0.0}));
  return world;
}

// Bodies go and come back, as they do when they cross borders.
void churn(TestWorld& world, const Pile& pile, int tick) {
  const int i = (tick / 20 * 13) % pile.bodies;
  const std::uint64_t id = static_cast<std::uint64_t>(i) + 10;
  if (tick < 30) return;
  if (tick % 20 == 0 && world.records().contains(id)) world.remove(id);
  if (tick % 20 == 10 && !world.records().contains(id)) {
    BodyRecord record = pile_body(pile, i);
    record.state.position = {3.0 + 0.1 * (i % 7), 3.1, 9.0};
    world.add(record);
  }
}

class PileTest : public testing::TestWithParam<Pile> {
 protected:
  EngineSettings settings() const {
    EngineSettings s = test_settings();
    s.sleep_after = GetParam().sleep_after;
    return s;
  }
  const std::unique_ptr<Engine> engine_ = test_engine(settings());
};

TEST_P(PileTest, RebuiltEveryFewTicksHasTheSameBits) {
  constexpr int kEvery[] = {1, 7, 50};
  TestWorld undisturbed = pile_world(*engine_, GetParam());
  std::vector<TestWorld> rebuilt;
  for (std::size_t i = 0; i < std::size(kEvery); ++i) rebuilt.push_back(pile_world(*engine_, GetParam()));
  for (int tick = 0; tick < kTicks; ++tick) {
    churn(undisturbed, GetParam(), tick);
    undisturbed.step();
    for (std::size_t i = 0; i < rebuilt.size(); ++i) {
      churn(rebuilt[i], GetParam(), tick);
      if (tick % kEvery[i] == 0) rebuilt[i] = rebuilt[i].rebuilt(*engine_, static_cast<std::uint64_t>(tick));
      rebuilt[i].step();
      ASSERT_EQ(undisturbed.hash(), rebuilt[i].hash()) << "tick " << tick << ", rebuilt every " << kEvery[i];
    }
  }
  if (GetParam().sleep_after > 0) {
    EXPECT_GT(undisturbed.asleep(), 0u);
  }
}

TEST_P(PileTest, OrderOfAddingDoesNotMatter) {
  TestWorld forwards = pile_world(*engine_, GetParam());
  TestWorld backwards = pile_world(*engine_, GetParam(), true);
  for (int tick = 0; tick < 300; ++tick) {
    forwards.step();
    backwards.step();
    ASSERT_EQ(forwards.hash(), backwards.hash()) << "tick " << tick;
  }
}

TEST_P(PileTest, WorldsOnTwoThreadsHaveTheSameBits) {
  TestWorld alone = pile_world(*engine_, GetParam());
  TestWorld first = pile_world(*engine_, GetParam());
  TestWorld second = pile_world(*engine_, GetParam());
  const auto run = [](TestWorld& world) {
    for (int tick = 0; tick < 200; ++tick) world.step();
  };
  run(alone);
  std::thread other(run, std::ref(first));
  run(second);
  other.join();
  EXPECT_EQ(alone.hash(), first.hash());
  EXPECT_EQ(alone.hash(), second.hash());
}

TEST(HistoryTest, PairsThatWereNearAreNoNearerForIt) {
  // Bullet's distance for contacts grows with the bodies, here to more than a metre, and its broadphase keeps
  // pairs in padded boxes: one that came from nearer would still be looked at.
  const auto engine = test_engine(test_settings());
  constexpr ShapeId kTower = 100;
  engine->add_shape(kTower, {{{Cylinder{50, 100}, {}}}});
  const auto at_gap = [](double gap) {
    BodyRecord record = dynamic_body(11, kTower, {100 + gap, 0, 0});
    record.properties.gravity = false;
    return record;
  };
  BodyRecord other = dynamic_body(10, kTower, {0, 0, 0});
  other.properties.gravity = false;
  TestWorld came(*engine);
  came.add(other);
  came.add(at_gap(0.12));
  came.world().set_state(came.slot(11), at_gap(0.16).state);
  came.world().detect(1.0 / 60);
  TestWorld fresh(*engine);
  fresh.add(other);
  fresh.add(at_gap(0.16));
  fresh.world().detect(1.0 / 60);
  EXPECT_EQ(came.world().contacts().size(), fresh.world().contacts().size());
}

const Pile kPiles[] = {
    {"boxes", {kBoxShape}, kFloorShape, 0},
    {"convex",
     {kBoxShape, kSphereShape, kCylinderShape, kCapsuleShape, kHullShape, kEllipsoidShape},
     kFloorShape,
     0},
    {"convex_on_plane", {kSphereShape, kCylinderShape, kHullShape, kEllipsoidShape}, kPlaneShape, 0},
    {"convex_on_mesh", {kBoxShape, kSphereShape, kHullShape}, kMeshShape, 0, 60},
    {"convex_on_height_field", {kBoxShape, kCapsuleShape, kCylinderShape}, kHeightFieldShape, 0, 60},
    {"compounds", {kDumbbellShape, kTableShape}, kFloorShape, 0},
    {"all_on_tiles",
     {kBoxShape, kTableShape, kSphereShape, kCylinderShape, kDumbbellShape, kHullShape, kEllipsoidShape},
     kCompoundFloorShape,
     0,
     60},
    {"compounds_on_mesh", {kDumbbellShape, kTableShape}, kMeshShape, 0, 40},
    {"large_boxes", {kLargeBoxShape}, kFloorShape, 0, 40, 6.01},
    {"fast_balls", {kSmallBallShape, kBoxShape}, kFloorShape, 0, 120, 1, 40},
    {"sleepy_boxes", {kBoxShape}, kFloorShape, 0.5, 60},
    {"sleepy_all",
     {kBoxShape, kTableShape, kCylinderShape, kDumbbellShape, kHullShape, kSphereShape},
     kFloorShape,
     0.5,
     60},
};

INSTANTIATE_TEST_SUITE_P(Piles, PileTest, testing::ValuesIn(kPiles),
                         [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace tessera::engine_tests
