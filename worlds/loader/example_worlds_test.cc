// Our own worlds load and hold what they promise; so do worlds that nobody here wrote.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

using std::filesystem::path;
using testing::AnyOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const path kWorlds = TESSERA_SOURCE_WORLDS;

LoadedWorld load_example(const path& file) {
  absl::StatusOr<LoadedWorld> loaded = load_world_file(file);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? *std::move(loaded) : LoadedWorld{};
}

std::size_t dynamic_bodies(const LoadedWorld& loaded) {
  std::size_t count = 0;
  for (const BodyDescription& body : loaded.world.bodies) count += body.properties.motion == Motion::kDynamic;
  return count;
}

std::set<SectorIndex> sectors(const LoadedWorld& loaded, const std::string& prefix) {
  std::set<SectorIndex> result;
  for (const BodyDescription& body : loaded.world.bodies) {
    if (absl::StartsWith(body.name, prefix)) result.insert(body.pose.position.sector);
  }
  return result;
}

// A notice that nothing is left out of.
const auto kIsFine =
    AnyOf(HasSubstr("simulated"), HasSubstr("is the program"), HasSubstr("for sensors alone"),
          HasSubstr("for the web UI alone"), HasSubstr("treated as static"));

TEST(OwnWorlds, AllLoadWithoutNoticesOfWhatIsLeftOut) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kWorlds)) {
    if (entry.path().extension() != ".sdf") continue;
    ++count;
    EXPECT_THAT(load_example(entry.path()).notices, Each(kIsFine)) << entry.path();
  }
  EXPECT_GE(count, 6);
}

TEST(OwnWorlds, AllModelsLoad) {
  for (const auto& entry : std::filesystem::directory_iterator(kWorlds / "models")) {
    EXPECT_THAT(load_example(entry.path()).notices, Each(kIsFine)) << entry.path();
  }
}

TEST(OwnWorlds, Zones) {
  const LoadedWorld loaded = load_example(kWorlds / "zones.sdf");
  EXPECT_EQ(dynamic_bodies(loaded), 2u);
  EXPECT_EQ(std::ranges::count_if(loaded.world.bodies,
                                  [](const BodyDescription& body) { return body.properties.trigger; }),
            1);
  EXPECT_EQ(std::ranges::count_if(loaded.world.shapes, has_triggers), 1);
}

TEST(OwnWorlds, Falling) { EXPECT_EQ(dynamic_bodies(load_example(kWorlds / "falling.sdf")), 10u); }

TEST(OwnWorlds, Tower) { EXPECT_EQ(dynamic_bodies(load_example(kWorlds / "tower.sdf")), 10u); }

TEST(OwnWorlds, SeamHasABorderInTheMiddleOfATower) {
  const LoadedWorld loaded = load_example(kWorlds / "seam.sdf");
  EXPECT_EQ(sectors(loaded, "tower_1").size(), 2u);
  EXPECT_EQ(sectors(loaded, "tower_2").size(), 2u);
  EXPECT_GE(sectors(loaded, "").size(), 5u);
}

TEST(OwnWorlds, BusyLiesAroundManyBorders) {
  const LoadedWorld loaded = load_example(kWorlds / "busy.sdf");
  EXPECT_EQ(dynamic_bodies(loaded), 60u);
  EXPECT_GE(sectors(loaded, "").size(), 4u);
}

TEST(OwnWorlds, MachinesStandOnBothSidesOfABorder) {
  const LoadedWorld loaded = load_example(kWorlds / "machines.sdf");
  EXPECT_THAT(loaded.notices, ElementsAre("26 joints (21 ball, 5 revolute) simulated"));
  EXPECT_EQ(dynamic_bodies(loaded), 27u);
  EXPECT_EQ(loaded.world.joints.size(), 26u);
  EXPECT_EQ(sectors(loaded, "").size(), 4u);
  for (const JointDescription& joint : loaded.world.joints) {
    const bool driven = absl::EndsWith(joint.name, "_motor");
    EXPECT_EQ(joint.drives[0], driven ? (JointDrive{DriveMode::kVelocity, 4}) : JointDrive{}) << joint.name;
  }
}

TEST(OwnWorlds, EarthHasThreeTownsFarFromItsCentre) {
  const LoadedWorld loaded = load_example(kWorlds / "earth.sdf");
  EXPECT_EQ(dynamic_bodies(loaded), 3006u);
  ASSERT_TRUE(std::holds_alternative<CentralGravity>(loaded.world.settings.gravity));
  std::size_t towers = 0;
  for (const BodyDescription& body : loaded.world.bodies) {
    const Eigen::Vector3d place = relative_to(body.pose.position, {}, loaded.world.settings.sector_size);
    EXPECT_NEAR(place.norm(), 6.37e6, 2e4) << body.name;
    if (!absl::StartsWith(body.name, "tower")) continue;
    ++towers;
    // A crate stands upright where gravity pulls to.
    EXPECT_GT((body.pose.orientation * Eigen::Vector3d::UnitZ()).dot(place.normalized()), 1 - 1e-9)
        << body.name;
  }
  EXPECT_EQ(towers, 600u);
}

// The folder of other projects' worlds, or a skipped test.
class OtherWorlds : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TESSERA_WORLDS");
    if (folder == nullptr) GTEST_SKIP() << "TESSERA_WORLDS is not set";
    folder_ = folder;
  }

  path folder_;
};

TEST_F(OtherWorlds, AllLoad) {
  int count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
    if (entry.path().extension() != ".sdf" && entry.path().extension() != ".urdf") continue;
    ++count;
    EXPECT_THAT(load_example(entry.path()).world.bodies, testing::Not(IsEmpty())) << entry.path();
  }
  EXPECT_GE(count, 15);
}

TEST_F(OtherWorlds, ThreeThousandShapesShareFour) {
  const LoadedWorld loaded = load_example(folder_ / "gazebo/3k_shapes.sdf");
  EXPECT_EQ(loaded.world.bodies.size(), 3004u);
  EXPECT_EQ(loaded.world.shapes.size(), 4u);
  EXPECT_EQ(loaded.world.settings.time_step, 0.001);
  EXPECT_THAT(loaded.notices, Contains("3004 x <visual> for the web UI alone"));
}

TEST_F(OtherWorlds, DuckIsACompoundOfHulls) {
  const LoadedWorld loaded = load_example(folder_ / "bullet/duck_vhacd.urdf");
  ASSERT_EQ(loaded.world.bodies.size(), 1u);
  EXPECT_EQ(loaded.world.shapes[loaded.world.bodies[0].properties.shape].parts.size(), 5u);
}

TEST_F(OtherWorlds, JointsAreSimulated) {
  EXPECT_THAT(load_example(folder_ / "gazebo/pendulum_links.sdf").notices,
              Contains("2 joints (2 revolute) simulated"));
  EXPECT_THAT(load_example(folder_ / "bullet/hinge.urdf").notices,
              Contains("2 joints (1 ball, 1 revolute) simulated"));
  const LoadedWorld vehicles = load_example(folder_ / "gazebo/diff_drive.sdf");
  EXPECT_THAT(vehicles.notices, Contains("6 joints (2 ball, 4 revolute) simulated"));
  EXPECT_THAT(vehicles.notices, Contains("2 x <plugin> gz-sim-diff-drive-system is the program diff_drive"));
  EXPECT_EQ(vehicles.world.joints.size(), 6u);
}

}  // namespace
}  // namespace tessera
