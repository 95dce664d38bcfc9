// What a tick of a world costs in memory: nothing, as long as nothing new happens in it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>
#include <vector>

#include "lpss/native/native_engine.h"

namespace {

std::atomic<std::size_t> allocations = 0;

void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  void* const memory = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) std::abort();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace tessera::native {
namespace {

constexpr double kTick = 1.0 / 60;
constexpr ShapeId kFloor = 0;
constexpr ShapeId kBox = 1;
constexpr ShapeId kZone = 2;

EngineSettings settings() {
  EngineSettings settings;
  settings.precision = sizeof(Scalar) == sizeof(float) ? Precision::kFloat32 : Precision::kFloat64;
  settings.sleep_after = 0;
  return settings;
}

BodyRecord record(std::uint64_t id, ShapeId shape, Motion motion, const std::array<double, 3>& position) {
  BodyRecord record;
  record.id = BodyId{id};
  record.properties.shape = shape;
  record.properties.motion = motion;
  record.properties.inertia = {1.0 / 6, 1.0 / 6, 1.0 / 6};
  record.state.position = position;
  return record;
}

// Columns of boxes, of one and of three, so that tasks have parts with different numbers of substeps.
class Pile {
 public:
  Pile() : engine_(settings()) {
    engine_.add_shape(kFloor, Shape{{ShapePart{tessera::Box{{100, 100, 2}}, {}}}});
    engine_.add_shape(kBox, Shape{{ShapePart{tessera::Box{{1, 1, 1}}, {}}}});
    world_ = engine_.make_world();
    solver_ = engine_.make_solver();
    world_->add(record(1, kFloor, Motion::kStatic, {0, 0, -1}), Role::kStatic);
    std::uint64_t id = 2;
    for (int row = 0; row < 20; ++row) {
      for (int column = 0; column < 20; ++column) {
        for (int level = 0; level < (column % 2 == 0 ? 1 : 3); ++level) {
          const BodyRecord box = record(id++, kBox, Motion::kDynamic, {1.1 * row, 1.1 * column, 0.5 + level});
          const BodySlot slot = world_->add(box, Role::kHome);
          world_->set_gravity(slot, {0, 0, -9.81});
          task_.bodies.push_back({world_.get(), slot});
        }
        task_.islands.push_back({.bodies = task_.bodies.size()});
      }
    }
  }

  // The allocations of a tick, but for those of the list of contacts to be solved, which is the caller's.
  std::size_t step() {
    std::size_t before = allocations;
    world_->detect(kTick);
    const std::size_t pairs = world_->contacts().size();
    std::size_t made = allocations - before;
    add_contacts(pairs);
    before = allocations;
    solver_->solve(task_, kTick, solved_);
    world_->integrate(kTick);
    made += allocations - before;
    return made;
  }

  std::size_t contacts() { return world_->contacts().size(); }

  // A trigger over some of the boxes.
  void add_zone() {
    engine_.add_shape(kZone, Shape{{ShapePart{tessera::Box{{8, 8, 8}}, {}}}});
    BodyRecord zone = record(100'000, kZone, Motion::kStatic, {5, 5, 0});
    zone.properties.trigger = true;
    world_->add(zone, Role::kStatic);
  }

  // Likewise the allocations of finding what is in it.
  std::size_t notice() {
    const std::size_t before = allocations;
    overlaps_.swap(overlaps_before_);
    world_->find_overlaps(overlaps_before_, overlaps_);
    return allocations - before;
  }
  std::size_t overlaps() const { return overlaps_.size(); }

 private:
  // Slots follow the floor's in the order of the task.
  void add_contacts(std::size_t pairs) {
    task_.contacts.clear();
    for (std::uint32_t n = 0; n < pairs; ++n) {
      const ContactPair& pair = world_->contacts()[n];
      const auto place = [](BodySlot slot) {
        return slot > 0 ? static_cast<std::uint32_t>(slot - 1) : WorldPair::kFixed;
      };
      task_.contacts.push_back({world_.get(), n, place(pair.slot_a), place(pair.slot_b)});
    }
    std::ranges::stable_sort(task_.contacts, {},
                             [](const WorldPair& pair) { return std::min(pair.a, pair.b); });
    std::size_t next = 0;
    for (IslandEnd& island : task_.islands) {
      island.substeps = 0;
      for (; next < pairs && std::min(task_.contacts[next].a, task_.contacts[next].b) < island.bodies;
           ++next) {
        const int asked = world_->contacts()[task_.contacts[next].pair].substeps;
        island.substeps = std::max(island.substeps, asked);
      }
      island.contacts = next;
    }
  }

  NativeEngine engine_;
  std::unique_ptr<SectorWorld> world_;
  std::unique_ptr<IslandSolver> solver_;
  SolveTask task_;
  SolvedTask solved_;
  std::vector<Overlap> overlaps_;
  std::vector<Overlap> overlaps_before_;
};

// Chains of three boxes that hang from the world: of balls, and of hinges with limits and springs.
class Chains {
 public:
  Chains() : engine_(settings()) {
    engine_.add_shape(kBox, Shape{{ShapePart{tessera::Box{{1, 1, 1}}, {}}}});
    world_ = engine_.make_world();
    solver_ = engine_.make_solver();
    ball_.type = JointType::kBall;
    hinge_.type = JointType::kRevolute;
    hinge_.axes[0].lower = -0.5;
    hinge_.axes[0].upper = 0.5;
    hinge_.axes[0].spring_stiffness = 10;
    for (JointProperties* joint : {&ball_, &hinge_}) {
      joint->in_parent.position = {0, 0, -0.5};
      joint->in_child.position = {0, 0, 0.5};
    }
    std::uint64_t id = 1;
    for (int chain = 0; chain < 20; ++chain) {
      std::size_t above = IslandJoint::kNoBody;
      for (int link = 0; link < 3; ++link) {
        const std::array<double, 3> at = {2.0 * chain, 0, -1.0 * link};
        const BodySlot slot = world_->add(record(id, kBox, Motion::kDynamic, at), Role::kHome);
        const std::size_t body = task_.bodies.size();
        task_.bodies.push_back({world_.get(), slot});
        IslandJoint joint;
        joint.id = JointId{id++};
        joint.form = chain % 2 == 0 ? &ball_ : &hinge_;
        joint.drives = &drives_;
        joint.child = body;
        joint.parent = above;
        joint.fixed_parent.position = {at[0], 0, 0.5};
        task_.joints.push_back(joint);
        above = body;
      }
      task_.islands.push_back({task_.bodies.size(), 0, task_.joints.size(), 0});
    }
  }

  std::size_t step() {
    const std::size_t before = allocations;
    world_->detect(kTick);
    for (const WorldBody& body : task_.bodies) world_->set_gravity(body.slot, {0, 9, -9.81});
    solver_->solve(task_, kTick, solved_);
    world_->integrate(kTick);
    return allocations - before;
  }

 private:
  NativeEngine engine_;
  std::unique_ptr<SectorWorld> world_;
  std::unique_ptr<IslandSolver> solver_;
  JointProperties ball_;
  JointProperties hinge_;
  JointDrives drives_;
  SolveTask task_;
  SolvedTask solved_;
};

TEST(SteadyTick, HoldsJointsWithoutAllocation) {
  Chains chains;
  std::size_t warming_up = 0;
  for (int tick = 0; tick < 120; ++tick) warming_up += chains.step();
  ASSERT_GT(warming_up, 0u) << "allocations are counted";
  for (int tick = 0; tick < 60; ++tick) ASSERT_EQ(chains.step(), 0u) << "tick " << tick;
}

TEST(SteadyTick, DetectsSolvesAndIntegratesWithoutAllocation) {
  Pile pile;
  std::size_t warming_up = 0;
  for (int tick = 0; tick < 120; ++tick) warming_up += pile.step();
  ASSERT_GT(warming_up, 0u) << "allocations are counted";
  ASSERT_EQ(pile.contacts(), 800u);
  for (int tick = 0; tick < 60; ++tick) ASSERT_EQ(pile.step(), 0u) << "tick " << tick;
}

TEST(SteadyTick, NoticesWithoutAllocation) {
  Pile pile;
  pile.add_zone();
  for (int tick = 0; tick < 120; ++tick) {
    pile.step();
    pile.notice();
  }
  ASSERT_GT(pile.overlaps(), 50u);
  for (int tick = 0; tick < 60; ++tick) {
    ASSERT_EQ(pile.step(), 0u) << "tick " << tick;
    ASSERT_EQ(pile.notice(), 0u) << "tick " << tick;
  }
}

}  // namespace
}  // namespace tessera::native
