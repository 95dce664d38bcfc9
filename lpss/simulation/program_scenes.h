// What tests of programs have in common: worlds with programs that are run, told and watched.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_programs.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {

inline constexpr double kG = 9.81;  // m/s^2
inline constexpr double kDt = 1.0 / 60;

inline WorldSettings settings_of(double sector_size = 16) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{{0, 0, -kG}};
  return settings;
}

inline double value_of(const BodyRecord& body, absl::string_view name, std::size_t place = 0) {
  const ProgramRecord& record = body.programs.at(place);
  return record.values.at(place_of(name, find_program(record.kind)->values()).value());
}

inline BodyDescription& add_box(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& size,
                                const Eigen::Vector3d& position, Motion motion, double mass = 1) {
  return builder.add(name, builder.shape(Box{size}), mass, position, motion);
}

inline TellProgram told(const WorldDescription& world, absl::string_view body, absl::string_view input,
                        double value) {
  for (std::size_t n = 0; n < world.bodies.size(); ++n) {
    if (world.bodies[n].name != body) continue;
    const Program& of = *find_program(world.bodies[n].programs.at(0).kind);
    return {BodyId{n + 1}, 0, {{place_of(input, of.inputs()).value(), value}}, {}};
  }
  ADD_FAILURE() << "there is no body " << body;
  return {};
}

inline TellProgram told_all(const WorldDescription& world, absl::string_view body,
                            const std::vector<std::pair<absl::string_view, double>>& inputs) {
  TellProgram all;
  for (const auto& [name, value] : inputs) {
    const TellProgram one = told(world, body, name, value);
    all.id = one.id;
    all.inputs.push_back(one.inputs.front());
  }
  return all;
}

class Watched {
 public:
  explicit Watched(const WorldBuilder& builder, std::uint32_t partitions = 1)
      : world_(builder.world()), cluster_(cluster_of(world_, partitions)) {}

  void run(double seconds) {
    for (int tick = 0; tick < std::lround(seconds / kDt); ++tick) step();
  }
  void step(std::vector<Command> commands = {}) {
    cluster_->step(commands);
    for (Rank rank = 0; rank < cluster_->size(); ++rank) check_invariants(cluster_->partition(rank));
  }
  void tell(absl::string_view body, absl::string_view input, double value) {
    step({told(world_, body, input, value)});
  }

  BodyRecord body(absl::string_view name) const {
    const auto place = std::ranges::find(world_.bodies, name, &BodyDescription::name);
    return *cluster_->body(BodyId{static_cast<std::uint64_t>(place - world_.bodies.begin()) + 1});
  }
  Eigen::Vector3d position(absl::string_view name) const {
    const BodyRecord record = body(name);
    return metres_between(world_.anchor, record.home, world_.settings.sector_size) +
           Eigen::Vector3d(record.state.position.data());
  }
  Eigen::Vector3d velocity(absl::string_view name) const {
    return Eigen::Vector3d(body(name).state.linear_velocity.data());
  }
  PartitionCluster& cluster() { return *cluster_; }
  const WorldDescription& world() const { return world_; }

 private:
  WorldDescription world_;
  std::unique_ptr<PartitionCluster> cluster_;
};

// A slope of this angle (rad) along x, through the origin.
inline void add_slope(WorldBuilder& builder, double angle) {
  BodyDescription& slope = add_box(builder, "slope", {60, 60, 2}, {0, 0, 0}, Motion::kStatic);
  slope.pose.orientation = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY());
  slope.pose.position.local = slope.pose.orientation * Eigen::Vector3d(0, 0, -1);
}

// Of the world and of its programs, after each tick.
inline std::vector<std::pair<WorldHash, WorldHash>> hashes_of(PartitionCluster& cluster, int ticks) {
  std::vector<std::pair<WorldHash, WorldHash>> hashes;
  for (int tick = 0; tick < ticks; ++tick) {
    cluster.step();
    for (Rank rank = 0; rank < cluster.size(); ++rank) check_invariants(cluster.partition(rank));
    hashes.emplace_back(cluster.hash(), cluster.program_hash());
  }
  return hashes;
}

// `alone` are the hashes of one partition.
inline void expect_the_same_on_any_partitions(const WorldDescription& world,
                                              const std::vector<std::pair<WorldHash, WorldHash>>& alone) {
  for (const auto& [partitions, threads] : {std::pair{2u, 1}, std::pair{4u, 3}, std::pair{9u, 1}}) {
    const auto cluster = cluster_of(world, partitions, threads);
    const auto together = hashes_of(*cluster, static_cast<int>(alone.size()));
    const auto [a, b] = std::ranges::mismatch(alone, together);
    EXPECT_TRUE(a == alone.end()) << partitions << " partitions differ at tick " << a - alone.begin() + 1;
  }
}

}  // namespace tessera
