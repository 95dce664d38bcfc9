#include "experiments/performance/performance.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace tessera {
namespace {

// What is dropped moves, but is not thrown.
TEST(PerformanceExperiment, EveryWorldIsBesidePlainBulletAndStands) {
  absl::StatusOr<Report> report =
      measure_performance({.quick = true}, [](std::uint64_t, std::uint64_t, const Report&) { return true; });
  ASSERT_TRUE(report.ok()) << report.status();
  const std::map<std::string, double> drifts_max_m = {
      {"bin_all", 4},   {"bin_all_on_hills", 4}, {"bin_all_on_mesh", 4}, {"bin_boxes_on_mesh", 4},
      {"bin_balls", 4}, {"bin_boxes", 4},        {"bin_capsules", 4},    {"bin_cylinders", 4},
      {"mixed", 2},     {"pile", 0.2},           {"pile_to_rest", 0.2},  {"pyramid", 0.05},
      {"towers", 0.05}};
  std::map<std::string, int> worlds;
  for (const Row& row : report->table("rows")) {
    ++worlds[row["scene"]];
    EXPECT_GT(row["tick_us"], 0) << row;
    EXPECT_EQ(row["hash"].get<std::string>().size(), 32u) << row;
    const bool has_joints = row["scene"] == "mixed";
    EXPECT_EQ(row["gap_mm"].is_number(), has_joints) << row;
    if (row["world"] == "plain Bullet") {
      EXPECT_EQ(row["ratio"], 1) << row;
    } else if (row["world"] != "plain Bullet, 16 steps a tick") {
      if (has_joints) {
        EXPECT_LT(row["gap_mm"], 0.1) << row;
      }
      EXPECT_LT(row["drift_m"], drifts_max_m.at(row["scene"])) << row;
    }
  }
  EXPECT_EQ(worlds.size(), drifts_max_m.size());
  for (const auto& [scene, rows] : worlds) EXPECT_EQ(rows, scene == "mixed" ? 4 : 3) << scene;
}

}  // namespace
}  // namespace tessera
