// Worlds of others in which the first version was wrong ($TESSERA_WORLDS/found): each moves as it should, in
// the sectors that its file asks for, and in such as have borders through its middle.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/observe/mechanics.h"
#include "lpss/simulation/test_runs.h"
#include "worlds/knobs.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

// A world that runs, and what it has shown so far.
class Course {
 public:
  explicit Course(WorldDescription world)
      : world_(std::move(world)),
        mechanics_(MechanicsOfWorld::create(world_).value()),
        cluster_(cluster_of(world_, 1)),
        now_(look()),
        energy_at_first_(now_.energy()) {}

  void run(double seconds) {
    const double end =
        static_cast<double>(cluster_->tick()) + std::round(seconds / world_.settings.time_step);
    while (static_cast<double>(cluster_->tick()) < end) {
      cluster_->step();
      now_ = look();
      gap_ = std::max(gap_, now_.gap);
      moved_ = std::max(moved_, now_.kinetic);
      gained_ = std::max(gained_, now_.energy() - energy_at_first_);
      ASSERT_TRUE(cluster_->divergences().empty()) << "tick " << cluster_->tick();
      ASSERT_TRUE(std::isfinite(now_.energy())) << "tick " << cluster_->tick();
    }
  }

  // Measures gains from here on.
  void begin_anew() {
    energy_at_first_ = now_.energy();
    moved_ = now_.kinetic;
    gained_ = 0;
  }

  const Mechanics& now() const { return now_; }
  double gap() const { return gap_; }        // m, the largest so far
  double moved() const { return moved_; }    // J, likewise
  double gained() const { return gained_; }  // J, likewise

  double speed(std::string_view name) const {
    const std::array<double, 3> velocity = cluster_->body(id(name)).value().state.linear_velocity;
    return std::hypot(velocity[0], velocity[1], velocity[2]);
  }
  // m, from the centre of the anchor's sector.
  Eigen::Vector3d place(std::string_view name) const {
    const BodyRecord record = cluster_->body(id(name)).value();
    return relative_to(body_pose(record, world_.settings.sector_size).position, world_.anchor,
                       world_.settings.sector_size);
  }
  bool all_asleep() const {
    return std::ranges::none_of(
        movable(), [](const BodyRecord& body) { return body.state.activity == Activity::kAwake; });
  }

 private:
  BodyId id(std::string_view name) const {
    const auto found = std::ranges::find(world_.bodies, name, &BodyDescription::name);
    EXPECT_NE(found, world_.bodies.end()) << name;
    return BodyId{static_cast<std::uint64_t>(found - world_.bodies.begin()) + 1};
  }
  std::vector<BodyRecord> movable() const {
    std::vector<BodyRecord> bodies;
    for (std::size_t n = 0; n < world_.bodies.size(); ++n) {
      if (world_.bodies[n].properties.motion == Motion::kDynamic)
        bodies.push_back(cluster_->body(BodyId{n + 1}).value());
    }
    return bodies;
  }
  Mechanics look() {
    return mechanics_.at(movable(), world_.settings.time_step / world_.settings.substeps / 2);
  }

  const WorldDescription world_;
  MechanicsOfWorld mechanics_;
  std::unique_ptr<PartitionCluster> cluster_;
  Mechanics now_;
  double energy_at_first_;
  double gap_ = 0;
  double moved_ = 0;
  double gained_ = 0;
};

// By the size of sectors (m); 0: that of the file.
class FoundWorlds : public testing::TestWithParam<double> {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TESSERA_WORLDS");
    if (folder == nullptr) GTEST_SKIP() << "TESSERA_WORLDS is not set";
    folder_ = std::filesystem::path(folder) / "found";
  }

  WorldDescription read(const std::string& name) const {
    absl::StatusOr<LoadedWorld> loaded = load_world_file(folder_ / name);
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    WorldDescription world = loaded.ok() ? std::move(loaded->world) : WorldDescription();
    world.settings.precision = engine_tests::test_precision;
    if (GetParam() > 0) {
      const absl::Status status = change_sector_size(world, GetParam());
      EXPECT_TRUE(status.ok()) << status;
    }
    return world;
  }

  std::filesystem::path folder_;
};

TEST_P(FoundWorlds, AFourBarTurnsAsItsMotorWantsAndStaysWhole) {
  Course course(read("fourbar_motor.sdf"));
  ASSERT_NO_FATAL_FAILURE(course.run(20));
  EXPECT_LT(course.gap(), 1e-5);
  EXPECT_NEAR(course.now().joints.front().velocity[0], 6, 0.01);
}

TEST_P(FoundWorlds, ChainsAndBridgesHoldAndGainNoEnergy) {
  for (const char* name : {"chain10.sdf", "br5.sdf", "br10_crash_substeps1sub.sdf", "bridge_1.sdf"}) {
    SCOPED_TRACE(name);
    Course course(read(name));
    ASSERT_NO_FATAL_FAILURE(course.run(2));
    // What had been dropped has landed.
    course.begin_anew();
    ASSERT_NO_FATAL_FAILURE(course.run(13));
    // In one step of 1/60 s, a bridge that swings is held by rows as they were at its start.
    const bool is_one_step = std::string_view(name) == "br10_crash_substeps1sub.sdf";
    EXPECT_LT(course.gap(), is_one_step ? 1.5e-3 : 1e-3);
    EXPECT_LT(course.gained(), 0.005 * course.moved());
  }
}

TEST_P(FoundWorlds, WhatRollsOnALevelFloorGainsNoSpeed) {
  Course course(read("rolls_box.sdf"));
  ASSERT_NO_FATAL_FAILURE(course.run(60));
  for (const char* name : {"cyl::l", "disc::l", "drum::l", "capsule::l", "sphere::l", "ellipsoid::l"}) {
    const double radius = std::string_view(name) == "drum::l" ? 1 : 0.2;
    EXPECT_LT(course.speed(name), 0.3 + 1e-3) << name;
    EXPECT_GT(course.place(name).z(), 0.99 * radius) << name;
  }
}

TEST_P(FoundWorlds, ACartWithFreeWheelsStands) {
  Course course(read("cart_box_rest.sdf"));
  const Eigen::Vector3d start = course.place("cart::chassis");
  ASSERT_NO_FATAL_FAILURE(course.run(8));
  const Eigen::Vector3d way = course.place("cart::chassis") - start;
  EXPECT_LT(way.head<2>().norm(), 1e-4) << way.transpose();
  EXPECT_LT(std::abs(way.z()), 0.005);
  EXPECT_TRUE(course.all_asleep());
}

TEST_P(FoundWorlds, FiveCylindersOnEachOtherStandAndFallAsleep) {
  Course course(read("cyl_stack_box.sdf"));
  const Eigen::Vector3d start = course.place("c4::l");
  ASSERT_NO_FATAL_FAILURE(course.run(10));
  EXPECT_LT((course.place("c4::l") - start).norm(), 0.01);
  EXPECT_TRUE(course.all_asleep());
}

TEST_P(FoundWorlds, ABallThatIsDroppedOnAVertexLands) {
  Course course(read("bump_one.sdf"));
  for (int second = 0; second < 10; ++second) {
    ASSERT_NO_FATAL_FAILURE(course.run(1));
    EXPECT_GT(course.place("s::l").z(), 0) << "after " << second + 1 << " s";
  }
}

TEST_P(FoundWorlds, AllEndInTheSameBitsInOnePartitionTwoAndThree) {
  constexpr int kTicks = 150;  // what diverged did so from tick 134 on
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    if (entry.path().extension() != ".sdf") continue;
    SCOPED_TRACE(entry.path().filename());
    const WorldDescription world = read(entry.path().filename());
    const std::vector<WorldHash> one = run(world, 1, 1, kTicks);
    for (const std::uint32_t partitions : {2, 3})
      EXPECT_EQ(first_difference(one, run(world, partitions, 1, kTicks)), one.size()) << partitions;
  }
}

INSTANTIATE_TEST_SUITE_P(Sectors, FoundWorlds, testing::Values(0, 4));

}  // namespace
}  // namespace tessera
