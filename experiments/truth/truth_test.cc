// Rows say what is right, what was found, and whether that is within its bound.
#include "experiments/truth/truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "experiments/truth/ray_oracle.h"
#include "experiments/truth/scene.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

Report report_of(const std::string& only, Precision precision = Precision::kFloat32) {
  absl::StatusOr<Report> report =
      measure_truth({.precision = precision, .quick = true, .only = only},
                    [](std::uint64_t, std::uint64_t, const Report&) { return true; });
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? *std::move(report) : Report();
}

TEST(TruthExperiment, ARowSaysWhatIsRightAndWhatWasFound) {
  Report report = report_of("impact head_on_1:1_e_1");
  const std::vector<Row>& rows = report.table("rows");
  ASSERT_GE(rows.size(), 12u) << "four quantities, in two sizes of sectors and in Bullet";
  EXPECT_EQ(rows[0]["engine"], "f32");
  EXPECT_EQ(rows[0]["sector_m"], 128);
  EXPECT_EQ(rows[4]["sector_m"], kBorderSectors);
  EXPECT_EQ(rows[8]["engine"], "Bullet f32");
  EXPECT_TRUE(rows[8]["sector_m"].is_null());
  for (std::size_t n = 0; n < 8; ++n) EXPECT_EQ(rows[n]["ok"], true) << rows[n];
  EXPECT_EQ(rows[1]["quantity"], "velocity of b");
  EXPECT_EQ(rows[1]["right"], 2);
  EXPECT_NEAR(rows[1]["got"], 2, rows[1]["bound"].get<double>());
  EXPECT_THAT(report.misses, testing::IsEmpty());
  EXPECT_EQ(report.table("summary").at(0)["ok"], 4);
}

TEST(TruthExperiment, HalfTheTimeStepTellsTheOrder) {
  const Report report = report_of("slide cube");
  const Row& way = report.tables.at(0).rows.at(1);
  EXPECT_EQ(way["quantity"], "way");
  EXPECT_NEAR(way["got"], way["right"].get<double>(), 2 * way["bound"].get<double>());
  EXPECT_TRUE(way["order"].is_null() || way["order"] > 0.5) << way;
}

TEST(TruthExperiment, BodiesThatCollideKeepTheirMomentum) {
  const Report report = report_of("conserved boxes_that_collide");
  EXPECT_THAT(report.misses, testing::IsEmpty());
}

// Soft rows yield under what they bear, however slowly what joints hold may be opened.
TEST(TruthExperiment, AQuadrupedStandsUnderAThousandTimesTheMassOfItsFeet) {
  const Report report = report_of("rest quadruped_1:1000", Precision::kFloat64);
  EXPECT_THAT(report.misses, testing::IsEmpty());
}

TEST(TruthExperiment, FramesThatMoveAreRight) {
  const Report report = report_of("frames");
  EXPECT_THAT(report.misses, testing::IsEmpty());
}

TEST(TruthExperiment, WhatIsNoNumberIsFarFromRight) {
  EXPECT_TRUE((Result{"", "", 1, 1.1, 0.11}).ok());
  EXPECT_FALSE((Result{"", "", 1, 1.2, 0.11}).ok());
  EXPECT_FALSE((Result{"", "", 1, std::numeric_limits<double>::quiet_NaN(), 1e300}).ok());
}

TEST(TruthExperiment, ScenesHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  std::set<std::string> quick_groups, groups;
  for (const Scene& scene : all_scenes()) {
    EXPECT_TRUE(names.insert(scene.group + " " + scene.name).second) << scene.name;
    EXPECT_TRUE(scene.measure || (scene.world && scene.results)) << scene.name;
    groups.insert(scene.group);
    if (scene.in_quick) quick_groups.insert(scene.group);
  }
  EXPECT_EQ(groups, quick_groups);
  EXPECT_FALSE(measure_truth({.only = "perpetual motion"}, {}).ok());
}

TEST(RayOracle, MeetsSolidsWhereTheyAre) {
  const auto at = [](const Geometry& geometry, const Vector3d& from, const Vector3d& to) {
    return RayOracle(geometry).distance(from, (to - from).normalized()).value_or(-1);
  };
  EXPECT_NEAR(at(Box{{1, 2, 3}}, {5, 0.3, 0.4}, {0, 0.3, 0.4}), 4.5, 1e-12);
  EXPECT_NEAR(at(Sphere{0.5}, {0, 3, 0.3}, {0, 0, 0.3}), 3 - 0.4, 1e-12);
  EXPECT_NEAR(at(Capsule{0.3, 0.6}, {0, 0, 2}, {0, 0, 0}), 1.4, 1e-12);
  EXPECT_NEAR(at(Capsule{0.3, 0.6}, {2, 0, 0.29}, {0, 0, 0.29}), 1.7, 1e-12);
  EXPECT_NEAR(at(Cylinder{0.5, 1}, {0.2, 0.1, 3}, {0.2, 0.1, 0}), 2.5, 1e-12);
  EXPECT_NEAR(at(Cylinder{0.5, 1}, {0.3, 3, 0}, {0.3, 0, 0}), 3 - 0.4, 1e-12);
  EXPECT_NEAR(at(Ellipsoid{{0.5, 0.3, 0.4}}, {0, 2, 0}, {0, 0, 0}), 1.7, 1e-12);
  const ConvexHull tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  EXPECT_NEAR(at(tetrahedron, {1, 1, 1}, {0, 0, 0}), std::sqrt(3.0) * 2 / 3, 1e-12);
  EXPECT_EQ(at(tetrahedron, {1, 1, 1}, {1, 1, 0}), -1);
  EXPECT_EQ(at(Sphere{0.5}, {0, 3, 0.51}, {0, 0, 0.51}), -1);
}

TEST(RayOracle, KnowsAllNormalsAtAnEdge) {
  const RayOracle box(Box{{1, 1, 1}});
  EXPECT_NEAR(box.normal_error({0.5, 0, 0}, Vector3d::UnitX(), 1e-6), 0, 1e-12);
  EXPECT_NEAR(box.normal_error({0.5, 0, 0}, Vector3d::UnitY(), 1e-6), std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(box.normal_error({0.5, 0.5, 0}, Vector3d::UnitY(), 1e-6), 0, 1e-12);
  const RayOracle ellipsoid(Ellipsoid{{0.5, 0.3, 0.4}});
  EXPECT_NEAR(ellipsoid.normal_error({0, 0, 0.4}, Vector3d::UnitZ(), 1e-6), 0, 1e-12);
  EXPECT_EQ(ellipsoid.normal_error({0, 0, 0.5}, Vector3d::UnitZ(), 1e-6), std::numbers::pi);
}

}  // namespace
}  // namespace tessera::truth
