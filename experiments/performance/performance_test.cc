#include "experiments/performance/performance.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace tessera {
namespace {

TEST(PerformanceExperiment, EveryWorldIsBesidePlainBulletAndStands) {
  absl::StatusOr<Report> report =
      measure_performance({.quick = true}, [](std::uint64_t, std::uint64_t) { return true; });
  ASSERT_TRUE(report.ok()) << report.status();
  std::map<std::string, int> worlds;
  for (const Row& row : report->table("rows")) {
    ++worlds[row["scene"]];
    EXPECT_GT(row["tick_us"], 0) << row;
    EXPECT_EQ(row["hash"].get<std::string>().size(), 32u) << row;
    if (row["world"] == "plain Bullet") {
      EXPECT_EQ(row["ratio"], 1) << row;
    } else if (row["scene"] != "pile" && row["scene"] != "pile_to_rest") {
      EXPECT_LT(row["drift_m"], 0.05) << row;
    }
  }
  EXPECT_EQ(worlds,
            (std::map<std::string, int>{{"pile", 3}, {"pile_to_rest", 3}, {"pyramid", 3}, {"towers", 3}}));
}

}  // namespace
}  // namespace tessera
