#include "cli/world_options.h"

#include <absl/strings/str_split.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace tessera::cli {
namespace {

// What a command line with these options changes of a world.
WorldOverrides parsed(const std::string& options) {
  CLI::App app;
  WorldOverrides overrides;
  add_override_options(app, overrides);
  std::vector<std::string> words = absl::StrSplit(options, ' ', absl::SkipEmpty());
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  app.parse(words);
  return overrides;
}

TEST(WorldOptionsTest, OfNoOverridesThereAreNone) { EXPECT_EQ(options_of({}), ""); }

TEST(WorldOptionsTest, ACommandThatIsRepeatedChangesTheSame) {
  const WorldOverrides given = parsed(
      "--shuffle 18446744073709551615 --engine f64 --seams clone --dt 0.0166666666666666 --adapt false "
      "--strict --shift=-2^62,0,7");
  const std::string options = options_of(given);
  const WorldOverrides again = parsed(options);
  EXPECT_EQ(to_json(again.knobs), to_json(given.knobs)) << options;
  EXPECT_EQ(again.knobs.get(&WorldSettings::precision), Precision::kFloat64) << options;
  EXPECT_EQ(again.knobs.get(&WorldSettings::shuffle), UINT64_MAX) << options;
  EXPECT_EQ(again.shift, given.shift) << options;
  EXPECT_TRUE(again.strict) << options;
}

}  // namespace
}  // namespace tessera::cli
