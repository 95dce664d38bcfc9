// The table of settings in README.md says what the list of settings says.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "lpss/model/settings.h"

namespace tessera {
namespace {

std::string table_of_settings(bool of_policy_clone) {
  std::vector<std::string> lines = {"| setting | meaning | unit | default | bounds |",
                                    "|---|---|---|---|---|"};
  for (const WorldSetting& setting : kSettings) {
    if (setting.of_policy_clone != of_policy_clone) continue;
    const std::string unit = *setting.unit == '\0' ? "" : absl::StrCat(setting.unit, " ");
    lines.push_back(absl::StrCat("| `", setting.name, "` | ", setting.help, " | ", unit, "| ",
                                 text_of(setting, WorldSettings()), " | ", bounds_of(setting), " |"));
  }
  return absl::StrJoin(lines, "\n");
}

TEST(SettingsDocumentationTest, TablesAreThoseOfTheList) {
  std::ifstream in(std::filesystem::path(TESSERA_SOURCE_WORLDS) / "README.md");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  for (const bool of_policy_clone : {false, true}) {
    const std::string table = table_of_settings(of_policy_clone);
    EXPECT_TRUE(absl::StrContains(text, absl::StrCat("\n\n", table, "\n\n")))
        << "worlds/README.md should have this table:\n"
        << table;
  }
}

}  // namespace
}  // namespace tessera
