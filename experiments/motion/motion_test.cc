// What the experiment `motion` holds the engine to, on short parts of it.
#include "experiments/motion/motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/engine/test_world.h"

namespace tessera {
namespace {

absl::StatusOr<Report> motion_of(const std::string& only) {
  return measure_motion({.precision = engine_tests::test_precision, .quick = true, .only = only},
                        [](std::uint64_t, std::uint64_t, const Report&) { return true; });
}

TEST(MotionExperiment, ShipsThatDockInOrbitStayWithinTheirBounds) {
  absl::StatusOr<Report> report = motion_of("orbit day");
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_THAT(report->misses, testing::IsEmpty());
  if (engine_tests::test_precision == Precision::kFloat32) {
    EXPECT_THAT(report->tables, testing::IsEmpty()) << "in double precision alone";
    return;
  }
  ASSERT_EQ(report->table("docking").size(), 1u);
  EXPECT_NEAR(report->table("docking").front()["speed"], 0.05, 1e-3);
  EXPECT_GT(report->table("docking").front()["pushes"], 100);
  EXPECT_EQ(report->table("kept").size(), 6u);
}

TEST(MotionExperiment, PartsAreChosenByName) {
  absl::StatusOr<Report> report = motion_of("brakes 4");
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_THAT(report->misses, testing::IsEmpty());
  EXPECT_EQ(report->tables.size(), 1u);
  EXPECT_FALSE(motion_of("perpetual motion").ok());
}

}  // namespace
}  // namespace tessera
