// A small partition made by hand, for tests of what works on one.
#pragma once

#include <memory>
#include <tuple>
#include <utility>

#include "lpss/engine/load_engine.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/partition.h"

namespace tessera {

// Two neighbouring sectors; where there are two servers, the first hosts kLow and the second kHigh.
inline constexpr SectorIndex kLow{-1, 0, 0};
inline constexpr SectorIndex kHigh{0, 0, 0};

inline constexpr ShapeId kUnitBox = 0;
inline constexpr ShapeId kUnitBall = 1;
inline constexpr ShapeId kGround = 2;

// A box at the first place in kLow and one at the second in kHigh overlap by 1/64 m over the border.
inline const Eigen::Vector3d kBeforeBorder{7.5, 0, 0};
inline const Eigen::Vector3d kBehindBorder{-7.515625, 0, 0};

// Sectors of 16 m and ticks of 1/64 s, which floats hold exactly, and no gravity.
inline WorldSettings test_settings() {
  WorldSettings settings;
  settings.sector_size = 16;
  settings.time_step = 1.0 / 64;
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  return settings;
}

// The same under the policy clone.
inline WorldSettings clone_settings(int depth = 1) {
  WorldSettings settings = test_settings();
  settings.seams = SeamPolicy::kClone;
  settings.clone_depth = depth;
  return settings;
}

// Server `self` of one or two, with an engine of its own.
class TestPartition {
 public:
  explicit TestPartition(const WorldSettings& settings = test_settings(), std::uint32_t servers = 1,
                         Rank self = 0)
      : engine_(load_engine(engine_settings(settings)).value()) {
    PartitionOptions options;
    options.settings = settings;
    options.map = SectorMap(kHigh, servers == 1 ? std::vector<SectorIndex>{} : std::vector{kHigh}, 1);
    options.self = self;
    partition_ = std::make_unique<Partition>(std::move(options), *engine_);
    add_shape(*partition_, kUnitBox, std::make_shared<const Shape>(Shape{{ShapePart{Box{}, {}}}}));
    add_shape(*partition_, kUnitBall, std::make_shared<const Shape>(Shape{{ShapePart{Sphere{}, {}}}}));
    add_shape(*partition_, kGround, std::make_shared<const Shape>(Shape{{ShapePart{Plane{}, {}}}}));
  }

  Partition& operator*() { return *partition_; }
  Partition* operator->() { return partition_.get(); }

 private:
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<Partition> partition_;
};

// A box of 1 m and 1 kg.
inline BodyRecord box(std::uint64_t id, const SectorIndex& home, const Eigen::Vector3d& position,
                      Motion motion = Motion::kDynamic) {
  BodyRecord record;
  record.id = BodyId{id};
  record.home = home;
  record.properties.motion = motion;
  record.properties.shape = kUnitBox;
  record.properties.inertia = {1.0 / 6, 1.0 / 6, 1.0 / 6};
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = position;
  return record;
}

inline BodyRecord moving(BodyRecord record, const Eigen::Vector3d& velocity) {
  Eigen::Map<Eigen::Vector3d>(record.state.linear_velocity.data()) = velocity;
  return record;
}

inline BodyRecord in_state(BodyRecord record, Activity activity) {
  record.state.activity = activity;
  return record;
}

inline HomeBody& body(Partition& partition, std::uint64_t id) { return *partition.bodies.at(BodyId{id}); }

inline Sector& sector(Partition& partition, const SectorIndex& index) { return *partition.sectors.at(index); }

inline BodyState state_of(Partition& partition, std::uint64_t id) {
  const HomeBody& asked = body(partition, id);
  return asked.sector->world->state(asked.slot);
}

inline Activity activity_of(Partition& partition, std::uint64_t id) {
  return state_of(partition, id).activity;
}

// Puts a body elsewhere in its sector, awake and at rest.
inline void put(Partition& partition, std::uint64_t id, const Eigen::Vector3d& position) {
  const HomeBody& moved = body(partition, id);
  BodyState state;
  Eigen::Map<Eigen::Vector3d>(state.position.data()) = position;
  moved.sector->world->set_state(moved.slot, state);
}

// All of a state, to be compared bit for bit.
inline auto bits(const BodyState& state) {
  return std::tuple(state.position, state.rotation, state.linear_velocity, state.angular_velocity,
                    state.still_for, static_cast<int>(state.activity));
}

}  // namespace tessera
