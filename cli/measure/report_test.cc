// What reports print.
#include "cli/measure/report.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(ReportTest, CellsOfACsvFileAreQuotedWhereTheyMust) {
  Row row;
  row["scene"] = "balls, 1 m";
  row["about"] = "a \"ball\"";
  row["ticks"] = 60;
  EXPECT_EQ(to_csv({row}), "scene,about,ticks\n\"balls, 1 m\",\"a \"\"ball\"\"\",60\n");
}

}  // namespace
}  // namespace tessera
