// Bodies, joints and contacts over several sectors that lie side by side along x, with the little of a tick
// around them that tests need. Positions are given and told relative to the centre of the first sector.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "lpss/engine/test_world.h"

namespace tessera::engine_tests {

inline constexpr double kSectorSize = 128;  // m
inline constexpr std::uint64_t kBase = 5;   // ids
inline constexpr std::uint64_t kLink = 10;
inline const Eigen::Vector3d kNoGravity = Eigen::Vector3d::Zero();

class JointScene {
 public:
  explicit JointScene(Engine& engine, int sectors = 1);
  explicit JointScene(Engine& engine, double dt) : JointScene(engine) { dt_ = dt; }

  // Gravity is felt by dynamic bodies only, as in an engine world.
  void add(const BodyRecord& record, int sector = 0, const Eigen::Vector3d& gravity = {0, 0, -9.81});

  // Ties two bodies where they are; parent 0 is the world. `frame` is that of the joint, of both bodies.
  std::size_t tie(JointType type, std::uint64_t parent, std::uint64_t child, const Pose& frame);
  JointProperties& joint(std::size_t n) { return joints_[n].properties; }
  JointAxis& axis(std::size_t n) { return joints_[n].properties.axes[0]; }
  JointDrive& drive(std::size_t n, std::size_t axis = 0) { return joints_[n].drives[axis]; }
  JointState joint_state(std::size_t n) const;

  // With a solver of its own, or with one that others use, too.
  void step() { step(*solver_); }
  void step(IslandSolver& solver);
  void run(double seconds);

  BodyState state(std::uint64_t id) const;
  void set_state(std::uint64_t id, const BodyState& state);
  SectorWorld& world(std::size_t sector = 0) { return *worlds_[sector]; }
  std::uint64_t hash() const;

 private:
  struct Home {
    int sector;
    BodySlot slot;
    Motion motion;
  };

  struct Tied {
    JointProperties properties;
    JointDrives drives;
    Pose fixed_parent;  // relative to the first sector
  };

  WorldBody place(BodyId id) const;
  JointSide side(BodyId id) const;
  IslandJoint island_joint(const Tied& tied, const std::map<std::uint64_t, std::size_t>& places) const;

  double dt_ = kTick;  // s
  std::vector<std::unique_ptr<SectorWorld>> worlds_;
  std::unique_ptr<IslandSolver> solver_;
  std::map<std::uint64_t, Home> homes_;
  std::vector<Tied> joints_;
};

// A body without collisions, of 1 kg and 1/6 kg m^2 unless it is changed.
BodyRecord ghost(std::uint64_t id, const Eigen::Vector3d& position);

// A frame at a place, with its x along `axis`.
Pose frame_at(const Eigen::Vector3d& position, const Eigen::Vector3d& axis = Eigen::Vector3d::UnitX());

}  // namespace tessera::engine_tests
