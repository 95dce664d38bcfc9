// One engine world with the little of a tick around it that tests of the engine need.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/engine/load_engine.h"

namespace tessera::engine_tests {

inline constexpr double kTick = 1.0 / 60;   // s
inline constexpr std::uint64_t kFloor = 1;  // the id of what others lie on

// The precision that this process tests, from the command line.
extern Precision test_precision;

EngineSettings test_settings();

// The engine in the tested precision; fails the test if it cannot be loaded.
std::unique_ptr<Engine> test_engine(const EngineSettings& settings);

// Shapes of about a metre, of every kind a dynamic body can have, under the ids 0 to kDynamicShapes - 1; and
// their bodies' moments of inertia for a mass of 1 kg (exactly or nearly: it does not matter here).
inline constexpr ShapeId kBoxShape = 0;
inline constexpr ShapeId kSphereShape = 1;
inline constexpr ShapeId kCylinderShape = 2;
inline constexpr ShapeId kCapsuleShape = 3;
inline constexpr ShapeId kHullShape = 4;
inline constexpr ShapeId kEllipsoidShape = 5;
inline constexpr ShapeId kDumbbellShape = 6;  // compound of two
inline constexpr ShapeId kTableShape = 7;     // compound of five
inline constexpr ShapeId kDynamicShapes = 8;
inline constexpr ShapeId kFloorShape = 8;  // a box of 100 x 100 x 2 m
inline constexpr ShapeId kPlaneShape = 9;
inline constexpr ShapeId kMeshShape = 10;           // 40 x 40 m, flat
inline constexpr ShapeId kHeightFieldShape = 11;    // 40 x 40 m, flat at z = 0.5 but for a corner at 3
inline constexpr ShapeId kCompoundFloorShape = 12;  // floor tiles of 5 m
inline constexpr ShapeId kLargeBoxShape = 13;       // 6 m
inline constexpr ShapeId kSmallBallShape = 14;      // 0.1 m
Shape test_shape(ShapeId id);
void add_test_shapes(Engine& engine);

// The height of the centre over the ground that a body of the shape rests on.
double resting_height(ShapeId id);

BodyRecord dynamic_body(std::uint64_t id, ShapeId shape, const Eigen::Vector3d& position);
BodyRecord static_body(std::uint64_t id, ShapeId shape, const Eigen::Vector3d& position);

// Steps a world alone: all its islands, solved in one task, asleep when all their bodies want to.
class TestWorld {
 public:
  explicit TestWorld(Engine& engine);

  BodySlot add(const BodyRecord& record, Role role = Role::kHome);
  BodySlot add_static(std::uint64_t id, const Shape& part, const Pose& pose);
  void remove(std::uint64_t id);
  void step(double dt = kTick);
  void run(int ticks) {
    for (int tick = 0; tick < ticks; ++tick) step();
  }

  SectorWorld& world() { return *world_; }
  BodySlot slot(std::uint64_t id) const { return slots_.at(id); }
  BodyState state(std::uint64_t id) const { return world_->state(slots_.at(id)); }
  double height(std::uint64_t id) const { return state(id).position[2]; }
  const std::map<std::uint64_t, BodyRecord>& records() const { return records_; }
  std::size_t asleep() const;

  // Of the states of all moving bodies.
  std::uint64_t hash() const;

  // A world with the same bodies and contacts, put together in an order that `seed` shuffles.
  TestWorld rebuilt(Engine& engine, std::uint64_t seed) const;

 private:
  void settle_islands();

  std::unique_ptr<SectorWorld> world_;
  std::unique_ptr<IslandSolver> solver_;
  std::map<std::uint64_t, BodyRecord> records_;
  std::map<std::uint64_t, BodySlot> slots_;
};

// A clone that stands for a body of a task.
struct CloneOf {
  WorldBody clone;
  std::size_t body;  // a place in the task
};

// Divides a task into its islands: puts the bodies, contacts and joints of each in a row, in the order in
// which they are, and tells contacts their places.
void divide_into_islands(SolveTask& task, const std::vector<CloneOf>& clones = {});

std::uint64_t hash_of(const BodyState& state, std::uint64_t seed);

}  // namespace tessera::engine_tests
