#include "cli/text.h"

#include <gtest/gtest.h>

namespace tessera::cli {
namespace {

TEST(GroupedTest, PutsCommas) {
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1000), "1,000");
  EXPECT_EQ(grouped(1234567), "1,234,567");
}

TEST(InOptionsTest, NamesOptionsWhereTheCoordinatorNamesFields) {
  EXPECT_EQ(in_options("a world is loaded; set `replace` to replace it"),
            "a world is loaded; add --replace to replace it");
  EXPECT_EQ(in_options("set `dry_run` or set `alone`"), "add --dry-run or add --alone");
  EXPECT_EQ(in_options("set `replace"), "set `replace");
  EXPECT_EQ(in_options("no `fields` to set"), "no `fields` to set");
}

}  // namespace
}  // namespace tessera::cli
