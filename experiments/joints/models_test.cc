// Every file becomes a row, whatever it holds.
#include "experiments/joints/models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

namespace tessera::models {
namespace {

// A pendulum, of so much mass a link.
std::string pendulum(double mass) {
  const std::string inertial = "<inertial><mass>" + std::to_string(mass) + "</mass></inertial>";
  return R"(<sdf version="1.9"><model name="pendulum">
    <link name="rod"><pose>0.5 0 0 0 0 0</pose>)" +
         inertial + R"(</link>
    <joint name="pivot" type="revolute"><parent>world</parent><child>rod</child>
      <pose>-0.5 0 0 0 0 0</pose><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>)";
}

class ModelsExperiment : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }

  absl::StatusOr<Report> measured(const std::string& only = "") const {
    return measure_models({.quick = true, .worlds = folder_.string(), .only = only},
                          [](std::uint64_t, std::uint64_t, const Report&) { return true; });
  }

  std::filesystem::path folder_;
};

TEST_F(ModelsExperiment, EveryFileBecomesARow) {
  write("swings/rod.sdf", pendulum(1));
  write("swings/light.sdf", pendulum(0));
  write("broken.urdf", "<robot name='r'><link/></robot>");
  write("readme.txt", "nothing");
  absl::StatusOr<Report> report = measured();
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_THAT(report->misses, testing::IsEmpty());
  std::map<std::string, Row> rows;
  for (const Row& row : report->table("rows")) rows[row["file"]] = row;
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows["broken.urdf"]["outcome"], "refused");
  EXPECT_NE(rows["broken.urdf"]["message"], "");
  EXPECT_EQ(rows["swings/light.sdf"]["outcome"], "repaired");
  EXPECT_NE(rows["swings/light.sdf"]["repairs"], "");
  const Row& rod = rows["swings/rod.sdf"];
  EXPECT_EQ(rod["outcome"], "loads");
  EXPECT_EQ(rod["joints"], 1);
  EXPECT_NEAR(rod["seconds"], 2, 0.02);
  EXPECT_LT(rod["gap_mm"], 0.1);
  EXPECT_EQ(rod["diverged"], 0);
  EXPECT_EQ(rod["same_bits"], true);
  EXPECT_LT(rod["energy_gain_j"], 0.01 * rod["kinetic_j"].get<double>());

  const std::vector<Row>& outcomes = report->table("outcomes");
  ASSERT_EQ(outcomes.size(), 2u);
  EXPECT_EQ(outcomes[0]["refused"], 1) << outcomes[0];
  EXPECT_EQ(outcomes[1]["folder"], "swings");
  EXPECT_EQ(outcomes[1]["loads"], 1);
  EXPECT_EQ(outcomes[1]["repaired"], 1);
}

// A trunk on two driven wheels and a ball that turns freely, as a caster does. Its files have no ground.
std::string wheeled_robot() {
  const auto wheel = [](const std::string& name, double y) {
    return "<link name='" + name + "'><pose>0 " + std::to_string(y) +
           " 0.1 -1.5707963 0 0</pose><inertial><mass>0.5</mass><inertia><ixx>0.0015</ixx><iyy>0.0015</iyy>"
           "<izz>0.0025</izz></inertia></inertial><collision "
           "name='c'><geometry><cylinder><radius>0.1</radius>"
           "<length>0.04</length></cylinder></geometry></collision></link>"
           "<joint name='" +
           name + "_axle' type='continuous'><parent>trunk</parent><child>" + name +
           "</child><axis><xyz>0 0 1</xyz></axis></joint>";
  };
  return "<sdf version='1.9'><model name='robot'><link name='trunk'><pose>0.05 0 0.12 0 0 0</pose>"
         "<inertial><mass>4</mass><inertia><ixx>0.03</ixx><iyy>0.04</iyy><izz>0.05</izz></inertia></inertial>"
         "<collision name='c'><geometry><box><size>0.4 0.2 0.06</size></box></geometry></collision></link>"
         "<link name='caster'><pose>0.2 0 0.05 0 0 "
         "0</pose><inertial><mass>0.2</mass><inertia><ixx>0.0002</ixx>"
         "<iyy>0.0002</iyy><izz>0.0002</izz></inertia></inertial><collision name='c'><geometry><sphere>"
         "<radius>0.05</radius></sphere></geometry></collision></link>"
         "<joint name='ball' type='ball'><parent>trunk</parent><child>caster</child></joint>" +
         wheel("left", 0.15) + wheel("right", -0.15) + "</model></sdf>";
}

TEST_F(ModelsExperiment, RobotsStandOnAPlaneAndDrive) {
  write("robot.sdf", wheeled_robot());
  write("pendulum.sdf", pendulum(1));
  absl::StatusOr<Report> report = measured();
  ASSERT_TRUE(report.ok()) << report.status();
  std::map<std::string, Row> rows;
  for (const Row& row : report->table("rows")) rows[row["file"]] = row;
  EXPECT_TRUE(rows["pendulum.sdf"]["lowest_mm"].is_null()) << "the world holds it";
  const Row& robot = rows["robot.sdf"];
  EXPECT_EQ(robot["wheels"], 2);
  EXPECT_GT(robot["lowest_mm"], -2) << robot;
  EXPECT_LT(robot["lowest_mm"], 1) << robot;
  EXPECT_NEAR(robot["wheel_way"], 1, 0.01) << robot;
  EXPECT_THAT(report->misses, testing::IsEmpty());
}

TEST_F(ModelsExperiment, FilesAreChosenByTheirPaths) {
  write("a/rod.sdf", pendulum(1));
  write("b/rod.sdf", pendulum(1));
  absl::StatusOr<Report> report = measured("b/");
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->table("rows").size(), 1u);
  EXPECT_FALSE(measured("c/").ok());
  EXPECT_FALSE(measure_models({}, {}).ok());
}

}  // namespace
}  // namespace tessera::models
