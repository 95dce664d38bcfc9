// Islands over several engine worlds: contacts found in sectors, solved in one place.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "lpss/engine/test_world.h"

namespace tessera::engine_tests {
namespace {

constexpr double kFrame = 128;  // m between the frames of two sectors
constexpr int kBoxes = 10;

// The body of box `i`, and which of the sectors it lives in.
std::uint64_t id_of(int box) { return static_cast<std::uint64_t>(box) + 10; }
double offset_of(int box) { return 0.02 * ((box * 7) % 5 - 2); }

// The same state in the frame of another sector.
BodyState moved(BodyState state, int sectors) {
  state.position[2] -= sectors * kFrame;
  return state;
}

// A tower of ten boxes over `sectors` sectors on top of each other. Each sector sees a clone of the lowest
// box of the next one, and detects the contact with it.
class Tower {
 public:
  Tower(Engine& engine, int sectors) : engine_(engine), solver_(engine.make_solver()), sectors_(sectors) {
    for (int s = 0; s < sectors; ++s) worlds_.push_back(engine.make_world());
    floor_ = static_body(kFloor, kFloorShape, {0, 0, -1});
    worlds_[0]->add(floor_, Role::kStatic);
    for (int i = 0; i < kBoxes; ++i) {
      const int s = sector_of(i);
      records_[i] = dynamic_body(id_of(i), kBoxShape, {offset_of(i), 0, i + 0.5 - s * kFrame});
      home_[i] = worlds_[s]->add(records_[i], Role::kHome);
      worlds_[s]->set_gravity(home_[i], {0, 0, -9.81});
      if (has_clone(i)) clone_[i] = worlds_[s - 1]->add(clone_record(i), Role::kClone);
    }
  }

  void detect() {
    for (int i = 0; i < kBoxes; ++i) {
      if (has_clone(i)) worlds_[sector_of(i) - 1]->set_state(clone_[i], clone_record(i).state);
    }
    for (const auto& world : worlds_) world->detect(kTick);
  }

  // One task over all worlds.
  void solve() {
    SolveTask task;
    for (int i = 0; i < kBoxes; ++i) task.bodies.push_back({worlds_[sector_of(i)].get(), home_[i]});
    divide(task);
    SolvedTask solved;
    solver_->solve(task, kTick, solved);
  }

  // The same elsewhere: from numbers alone.
  void solve_elsewhere() {
    SolveTask task;
    for (int i = 0; i < kBoxes; ++i) task.bodies.push_back({worlds_[sector_of(i)].get(), home_[i]});
    divide(task);
    std::vector<std::string> bodies;
    std::vector<std::string> pairs;
    const SolveTask here = task;
    for (WorldBody& body : task.bodies) {
      body.world->append_numbers(body.slot, bodies.emplace_back());
      body = {nullptr, static_cast<BodySlot>(bodies.size() - 1)};
    }
    for (WorldPair& pair : task.contacts) {
      pair.world->append_pair_numbers(pair.pair, pairs.emplace_back());
      pair = {nullptr, static_cast<std::uint32_t>(pairs.size() - 1), pair.a, pair.b};
    }
    task.shipped_bodies.assign(bodies.begin(), bodies.end());
    task.shipped_pairs.assign(pairs.begin(), pairs.end());
    SolvedTask solved;
    engine_.make_solver()->solve(task, kTick, solved);
    std::string_view of_bodies = solved.bodies;
    std::string_view of_pairs = solved.pairs;
    for (const WorldBody& body : here.bodies) ASSERT_TRUE(body.world->take_solved(body.slot, of_bodies));
    for (const WorldPair& pair : here.contacts)
      ASSERT_TRUE(pair.world->take_solved_pair(pair.pair, of_pairs));
    ASSERT_TRUE(of_bodies.empty() && of_pairs.empty());
    EXPECT_FALSE(here.bodies[0].world->take_solved(here.bodies[0].slot, of_bodies)) << "there is no more";
  }

  void integrate() {
    for (const auto& world : worlds_) world->integrate(kTick);
  }

  std::uint64_t hash() const {
    std::uint64_t hash = 1;
    for (int i = 0; i < kBoxes; ++i) hash = hash_of(state(i), hash);
    return hash;
  }
  double top() const { return state(kBoxes - 1).position[2]; }
  double drift() const {
    double drift = 0;
    for (int i = 0; i < kBoxes; ++i) {
      const BodyState s = state(i);
      drift = std::max(drift, std::hypot(s.position[0] - offset_of(i), s.position[1]));
    }
    return drift;
  }
  void push() { worlds_[sector_of(7)]->apply_impulse(home_[7], {0.3, 0, 0}, {0, 0, 0.1}); }

 private:
  int sector_of(int box) const { return box * sectors_ / kBoxes; }
  bool has_clone(int box) const { return box > 0 && sector_of(box) != sector_of(box - 1); }
  BodyState state(int box) const {
    return moved(worlds_[sector_of(box)]->state(home_[box]), -sector_of(box));
  }
  BodyRecord clone_record(int box) const {
    BodyRecord record = records_[box];
    record.state = moved(worlds_[sector_of(box)]->state(home_[box]), -1);
    return record;
  }
  // Adds the contacts.
  void divide(SolveTask& task) {
    for (const auto& world : worlds_) {
      for (std::uint32_t k = 0; k < world->contacts().size(); ++k) task.contacts.push_back({world.get(), k});
    }
    std::sort(task.contacts.begin(), task.contacts.end(), [](const WorldPair& x, const WorldPair& y) {
      const ContactPair& p = x.world->contacts()[x.pair];
      const ContactPair& q = y.world->contacts()[y.pair];
      return std::pair(p.a, p.b) < std::pair(q.a, q.b);
    });
    std::vector<CloneOf> clones;
    for (int i = 0; i < kBoxes; ++i) {
      if (has_clone(i)) clones.push_back({{worlds_[sector_of(i) - 1].get(), clone_[i]}, std::size_t(i)});
    }
    divide_into_islands(task, clones);
  }

  Engine& engine_;
  std::unique_ptr<IslandSolver> solver_;
  int sectors_;
  std::vector<std::unique_ptr<SectorWorld>> worlds_;
  BodyRecord floor_;
  BodyRecord records_[kBoxes];
  BodySlot home_[kBoxes] = {};
  BodySlot clone_[kBoxes] = {};
};

TEST(IslandTest, TowerOverSectorsStandsAsInOne) {
  const auto engine = test_engine(test_settings());
  for (int sectors : {1, 2, 5, 10}) {
    Tower tower(*engine, sectors);
    for (int tick = 0; tick < 600; ++tick) {
      tower.detect();
      tower.solve();
      tower.integrate();
    }
    EXPECT_NEAR(tower.top(), 9.49, 0.005) << sectors << " sectors";
    EXPECT_LT(tower.drift(), 0.06) << sectors << " sectors";
  }
}

TEST(IslandTest, SolvedElsewhereHasTheSameBits) {
  const auto engine = test_engine(test_settings());
  for (int sectors : {1, 3, 10}) {
    Tower here(*engine, sectors);
    Tower elsewhere(*engine, sectors);
    for (int tick = 0; tick < 300; ++tick) {
      here.detect();
      here.solve();
      here.integrate();
      elsewhere.detect();
      elsewhere.solve_elsewhere();
      elsewhere.integrate();
      ASSERT_EQ(here.hash(), elsewhere.hash()) << "tick " << tick << ", " << sectors << " sectors";
      if (tick == 100) {
        here.push();
        elsewhere.push();
      }
    }
  }
}

TEST(IslandTest, WhatElseIsInTheTaskDoesNotMatter) {
  const auto engine = test_engine(test_settings());
  const auto add_stack = [](TestWorld& world, std::uint64_t first, double x, int height) {
    for (int i = 0; i < height; ++i) {
      world.add(dynamic_body(first + static_cast<std::uint64_t>(i), kBoxShape, {x + 0.01 * i, 0, i + 0.5}));
    }
  };
  TestWorld together(*engine);
  TestWorld apart(*engine);
  TestWorld lone(*engine);
  for (TestWorld* world : {&together, &apart, &lone}) {
    world->add(static_body(kFloor, kFloorShape, {0, 0, -1}));
    add_stack(*world, 10, 0, 5);
  }
  for (TestWorld* world : {&together, &apart}) {
    add_stack(*world, 20, 5, 8);
    world->add(dynamic_body(30, kBoxShape, {10, 0, 40}));  // falls: no contact for a while
  }
  const auto solver = engine->make_solver();
  for (int tick = 0; tick < 200; ++tick) {
    together.step();
    lone.step();
    apart.world().detect(kTick);
    const std::pair<std::uint64_t, std::uint64_t> parts[] = {{20, 40}, {10, 19}};
    for (const auto& [low, high] : parts) {
      SolveTask task;
      const auto is_in = [&](BodyId id) { return low <= id.value && id.value <= high; };
      for (const auto& [id, record] : apart.records()) {
        if (is_in({id})) task.bodies.push_back({&apart.world(), apart.slot(id)});
      }
      const std::span<const ContactPair> contacts = apart.world().contacts();
      for (std::size_t k = 0; k < contacts.size(); ++k) {
        if (is_in(contacts[k].b)) task.contacts.push_back({&apart.world(), static_cast<std::uint32_t>(k)});
      }
      divide_into_islands(task);
      SolvedTask solved;
      solver->solve(task, kTick, solved);
    }
    apart.world().integrate(kTick);
    ASSERT_EQ(together.hash(), apart.hash()) << "tick " << tick;
    for (std::uint64_t id = 10; id < 15; ++id) {
      ASSERT_EQ(hash_of(together.state(id), 1), hash_of(lone.state(id), 1)) << "tick " << tick;
    }
  }
}

TEST(IslandTest, SolvedClonesCarryWithoutMoving) {
  // Policy clone: a clone of the lower box stands in the upper box's sector, on the floor it needs.
  EngineSettings settings = test_settings();
  settings.plain_bullet = true;
  const auto engine = test_engine(settings);
  const auto world = engine->make_world();
  const auto solver = engine->make_solver();
  world->add(static_body(kFloor, kFloorShape, {0, 0, -1}), Role::kStatic);
  const BodyRecord lower = dynamic_body(10, kBoxShape, {0, 0, 0.5});
  const BodySlot clone = world->add(lower, Role::kClone);
  const BodySlot upper = world->add(dynamic_body(11, kBoxShape, {0, 0, 1.5}), Role::kHome);
  for (BodySlot slot : {clone, upper}) world->set_gravity(slot, {0, 0, -9.81});
  for (int tick = 0; tick < 120; ++tick) {
    world->set_state(clone, lower.state);
    world->detect(kTick);
    EXPECT_EQ(world->contacts().size(), 2u);
    SolveTask task{{{world.get(), clone}, {world.get(), upper}}, {{world.get(), 0}, {world.get(), 1}}};
    SolvedTask solved;
    solver->solve(task, kTick, solved);
    EXPECT_LT(world->linear_velocity(clone).norm(), 0.2) << "the floor carries the clone";
    world->integrate(kTick);
  }
  EXPECT_NEAR(world->position(upper).z(), 1.5, 0.01);
}

TEST(ManifoldTest, TravelsWithABodyToAnotherSector) {
  // Two boxes lie on each other in one world, are taken to another whose frame is elsewhere, and lie still.
  const auto engine = test_engine(test_settings());
  TestWorld first(*engine);
  first.add(static_body(kFloor, kFloorShape, {0, 0, -1}));
  for (int i = 0; i < 5; ++i) first.add(dynamic_body(id_of(i), kBoxShape, {0, 0, i + 0.5}));
  for (int tick = 0; tick < 120; ++tick) first.step();

  TestWorld second(*engine);
  second.add(static_body(kFloor, kFloorShape, {0, 0, -1 - kFrame / 2}));
  for (const auto& [id, record] : first.records()) {
    if (id == kFloor) continue;
    BodyRecord travelling = record;
    travelling.state = first.state(id);
    travelling.state.position[2] -= kFrame / 2;
    second.add(travelling);
  }
  for (std::size_t k = 0; k < first.world().contacts().size(); ++k) {
    second.world().import_manifold(first.world().export_manifold(k));
  }
  ASSERT_EQ(second.world().contacts().size(), 5u);
  EXPECT_NEAR(second.world().touching_patches(0).at(0).impulse,
              first.world().touching_patches(0).at(0).impulse, 1e-6);
  const double top = second.height(id_of(4));
  for (int tick = 0; tick < 30; ++tick) {
    second.step();
    ASSERT_NEAR(second.height(id_of(4)), top, 1e-3);
  }
}

TEST(ManifoldTest, OfBodiesThatAreNotHereOrNotNearIsLeftOut) {
  const auto engine = test_engine(test_settings());
  TestWorld first(*engine);
  first.add(static_body(kFloor, kFloorShape, {0, 0, -1}));
  first.add(dynamic_body(10, kBoxShape, {0, 0, 0.5}));
  first.step();
  const ManifoldState manifold = first.world().export_manifold(0);
  TestWorld second(*engine);
  second.world().import_manifold(manifold);
  second.add(static_body(kFloor, kFloorShape, {0, 0, -1}));
  second.add(dynamic_body(10, kBoxShape, {0, 0, 20}));
  second.world().import_manifold(manifold);
  second.step();
  EXPECT_TRUE(second.world().contacts().empty());
}

}  // namespace
}  // namespace tessera::engine_tests
