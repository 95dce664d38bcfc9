// Islands solved in parts that agree after each pass.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "lpss/bullet/joint_scene.h"

namespace tessera::bullet {
namespace {

constexpr std::size_t kBoxes = 10;
constexpr std::uint64_t kFloor = 1;
constexpr double kSplit = 1.4;  // how much lighter the two copies of a body are

std::uint64_t id_of(std::size_t box) { return box + 10; }
double offset_of(std::size_t box) { return 0.02 * (static_cast<double>((box * 7) % 5) - 2); }

BodyRecord tower_box(std::size_t box) {
  return dynamic_body(id_of(box), kBoxShape, {offset_of(box), 0, static_cast<double>(box) + 0.5});
}

// Whether a tower stands on the floor, or hangs up into the sky from ball joints, its boxes passing each
// other.
enum class Kind { kStanding, kHanging };

// A tower, cut into parts with a world and a solver each. A part has a copy of the lowest box of the next
// one, and all that happens between the two.
class Tower {
 public:
  Tower(Engine& engine, int parts, Kind kind = Kind::kStanding) : kind_(kind) {
    for (int p = 0; p < parts; ++p) {
      worlds_.push_back(engine.make_world());
      solvers_.push_back(engine.make_part_solver());
    }
    worlds_[0]->add(static_body(kFloor, kFloorShape, {0, 0, kind == Kind::kStanding ? -1.0 : -9.0}),
                    Role::kStatic);
    for (std::size_t i = 0; i < kBoxes; ++i) {
      BodyRecord box = tower_box(i);
      if (kind == Kind::kHanging) box.properties.assembly = 1;
      home_[i] = worlds_[part_of(i)]->add(box, Role::kHome);
      worlds_[part_of(i)]->set_gravity(home_[i], {0, 0, kind == Kind::kStanding ? -9.81 : 9.81});
      if (is_shared(i)) copy_[i] = worlds_[part_of(i) - 1]->add(box, Role::kClone);
      joints_[i].type = JointType::kBall;
      joints_[i].in_child.position = {-offset_of(i), 0, -0.5};
      joints_[i].in_parent.position = {i == 0 ? 0 : -offset_of(i - 1), 0, i == 0 ? 0 : 0.5};
    }
  }

  void step() {
    detect();
    begin();
    agree(/*is_first=*/true);
    for (int n = 0; n < solvers_[0]->passes(); ++n) {
      for (const auto& solver : solvers_) solver->pass(n);
      agree(/*is_first=*/false);
    }
    for (const auto& solver : solvers_) solver->end();
    expect_agreement();
    for (const auto& world : worlds_) world->integrate(kTick);
  }

  void push(std::size_t box) { worlds_[part_of(box)]->apply_impulse(home_[box], {0.5, 0, 0}, {0, 0, 0}); }

  double top() const { return state(kBoxes - 1).position[2]; }
  double drift() const {
    double drift = 0;
    for (std::size_t i = 0; i < kBoxes; ++i) {
      drift = std::max(drift, std::hypot(state(i).position[0] - offset_of(i), state(i).position[1]));
    }
    return drift;
  }
  BodyState state(std::size_t box) const { return worlds_[part_of(box)]->state(home_[box]); }

 private:
  std::size_t part_of(std::size_t box) const { return box * worlds_.size() / kBoxes; }
  bool is_shared(std::size_t box) const { return box > 0 && part_of(box) != part_of(box - 1); }

  void detect() {
    for (std::size_t i = 0; i < kBoxes; ++i) {
      if (is_shared(i)) worlds_[part_of(i) - 1]->set_state(copy_[i], state(i));
    }
    for (const auto& world : worlds_) world->detect(kTick);
    for (std::size_t i = 0; i < kBoxes; ++i) {
      if (!is_shared(i)) continue;
      worlds_[part_of(i) - 1]->set_total_wrench(copy_[i], worlds_[part_of(i)]->total_wrench(home_[i]));
    }
  }

  void begin() {
    for (std::size_t p = 0; p < worlds_.size(); ++p) {
      SectorWorld& world = *worlds_[p];
      SolveTask task;
      std::vector<std::size_t> shared;
      for (std::size_t i = 0; i < kBoxes; ++i) {
        const bool is_copy = is_shared(i) && part_of(i) == p + 1;
        if (part_of(i) != p && !is_copy) continue;
        if (is_shared(i)) {
          if (is_copy) place_of_copy_[i] = shared.size();
          shared.push_back(task.bodies.size());
        }
        task.bodies.push_back({&world, is_copy ? copy_[i] : home_[i]});
        // A joint belongs to the part of the lower box.
        const bool is_joint_here = i == 0 || task.bodies.size() > 1;
        if (kind_ == Kind::kHanging && is_joint_here) task.joints.push_back(joint(i, task.bodies));
      }
      for (std::size_t k = 0; k < world.contacts().size(); ++k) task.contacts.push_back({&world, k});
      solvers_[p]->begin(task, shared, kTick);
    }
  }

  // Between the last body and the one before it.
  TaskJoint joint(std::size_t box, const std::vector<WorldBody>& bodies) const {
    TaskJoint joint;
    joint.properties = &joints_[box];
    joint.drives = &free_;
    joint.child = bodies.back();
    if (box > 0) joint.parent = bodies[bodies.size() - 2];
    return joint;
  }

  void agree(bool is_first) {
    for (std::size_t i = 0; i < kBoxes; ++i) {
      if (!is_shared(i)) continue;
      PartSolver& home = *solvers_[part_of(i)];
      PartSolver& other = *solvers_[part_of(i) - 1];
      VelocityChange sum = other.change(place_of_copy_[i]);
      sum += home.change(0);
      if (!is_first) sum = scaled(sum, 1 / kSplit);
      home.agree(0, sum);
      other.agree(place_of_copy_[i], sum);
      if (!is_first) continue;
      home.split(0, kSplit);
      other.split(place_of_copy_[i], kSplit);
    }
  }

  void expect_agreement() const {
    for (std::size_t i = 0; i < kBoxes; ++i) {
      if (!is_shared(i)) continue;
      const BodyState copy = worlds_[part_of(i) - 1]->state(copy_[i]);
      ASSERT_EQ(hash_of(state(i), 1), hash_of(copy, 1)) << "box " << i;
    }
  }

  const Kind kind_;
  const JointDrives free_;
  std::vector<std::unique_ptr<SectorWorld>> worlds_;
  std::vector<std::unique_ptr<PartSolver>> solvers_;
  std::array<JointProperties, kBoxes> joints_;  // of a box and the one below it
  std::array<BodySlot, kBoxes> home_{};
  std::array<BodySlot, kBoxes> copy_{};
  std::array<std::size_t, kBoxes> place_of_copy_{};  // among what its part shares
};

class CutTowerTest : public testing::TestWithParam<int> {};

TEST_P(CutTowerTest, StandsLikeTheWholeOne) {
  const auto engine = test_engine(test_settings());
  Tower whole(*engine, 1);
  Tower cut(*engine, GetParam());
  for (int tick = 0; tick < 600; ++tick) {
    whole.step();
    cut.step();
  }
  EXPECT_NEAR(cut.top(), whole.top(), 0.005);
  EXPECT_LT(cut.drift(), 0.03);
}

INSTANTIATE_TEST_SUITE_P(Parts, CutTowerTest, testing::Values(2, 5, 10), testing::PrintToStringParamName());

TEST_P(CutTowerTest, SwingsLikeTheWholeOne) {
  const auto engine = test_engine(test_settings());
  Tower whole(*engine, 1, Kind::kHanging);
  Tower cut(*engine, GetParam(), Kind::kHanging);
  double swing = 0;
  double apart = 0;
  for (Tower* tower : {&whole, &cut}) tower->push(kBoxes - 1);
  for (int tick = 0; tick < 300; ++tick) {
    whole.step();
    cut.step();
    swing = std::max(swing, whole.drift());
    for (std::size_t i = 0; i < kBoxes; ++i) {
      apart = std::max(apart, std::abs(cut.state(i).position[0] - whole.state(i).position[0]));
    }
  }
  EXPECT_GT(swing, 0.2);
  EXPECT_LT(apart, 0.1 * swing);
  // Joints give way a little more the more often the island is cut.
  EXPECT_NEAR(cut.top(), whole.top(), 0.1);
}

TEST(PartSolverTest, OnePartIsSolvedLikeAnIsland) {
  const auto engine = test_engine(test_settings());
  Tower part(*engine, 1);
  TestWorld island(*engine);
  island.add(static_body(kFloor, kFloorShape, {0, 0, -1}));
  for (std::size_t i = 0; i < kBoxes; ++i) island.add(tower_box(i));
  for (int tick = 0; tick < 300; ++tick) {
    part.step();
    island.step();
    for (std::size_t i = 0; i < kBoxes; ++i) {
      ASSERT_EQ(hash_of(part.state(i), 1), hash_of(island.state(id_of(i)), 1))
          << "box " << i << " tick " << tick;
    }
  }
}

TEST(PartSolverTest, PartsMayMeetTheSameKinematicBody) {
  EngineSettings settings = test_settings();
  settings.adapt = false;  // parts do not know what an island needs
  const auto engine = test_engine(settings);
  BodyRecord ground = static_body(kFloor, kFloorShape, {0, 0, -1});
  ground.properties.motion = Motion::kKinematic;
  ground.state.activity = Activity::kAwake;
  ground.state.linear_velocity = {0.5, 0, 0};
  TestWorld whole(*engine);
  const auto world = engine->make_world();
  whole.add(ground);
  world->add(ground, Role::kHome);
  std::array<BodySlot, 2> slots{};
  for (std::size_t i = 0; i < 2; ++i) {
    const BodyRecord box = dynamic_body(id_of(i), kBoxShape, {5.0 * static_cast<double>(i), 0, 0.5});
    whole.add(box);
    slots[i] = world->add(box, Role::kHome);
    world->set_gravity(slots[i], {0, 0, -9.81});
  }
  const std::array solvers{engine->make_part_solver(), engine->make_part_solver()};
  for (int tick = 0; tick < 60; ++tick) {
    whole.step();
    world->detect(kTick);
    ASSERT_EQ(world->contacts().size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      solvers[i]->begin({{{world.get(), slots[i]}}, {}, {{world.get(), i}}, {}}, {}, kTick);
    }
    for (int n = 0; n < solvers[0]->passes(); ++n) {
      for (const auto& solver : solvers) solver->pass(n);
    }
    for (const auto& solver : solvers) solver->end();
    world->integrate(kTick);
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(hash_of(world->state(slots[i]), 1), hash_of(whole.state(id_of(i)), 1)) << "tick " << tick;
    }
  }
  EXPECT_GT(world->linear_velocity(slots[0]).x(), 0.4) << "carried along";
}

TEST(PartSolverTest, APartMayBeEmpty) {
  const auto engine = test_engine(test_settings());
  const auto solver = engine->make_part_solver();
  EXPECT_GE(solver->passes(), test_settings().solver_iterations);
  solver->begin({}, {}, kTick);
  solver->pass(0);
  solver->end();
}

}  // namespace
}  // namespace tessera::bullet
