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

std::string table_of_settings() {
  std::vector<std::string> lines = {"| setting | meaning | unit | default | bounds |",
                                    "|---|---|---|---|---|"};
  for (const WorldSetting& setting : kSettings) {
    const std::string unit = *setting.unit == '\0' ? "" : absl::StrCat(setting.unit, " ");
    lines.push_back(absl::StrCat("| `", setting.name, "` | ", setting.help, " | ", unit, "| ",
                                 text_of(setting, WorldSettings()), " | ", bounds_of(setting), " |"));
  }
  return absl::StrJoin(lines, "\n");
}

TEST(SettingsDocumentationTest, TableIsThatOfTheList) {
  std::ifstream in(std::filesystem::path(TESSERA_SOURCE_WORLDS) / "README.md");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  EXPECT_TRUE(absl::StrContains(text, absl::StrCat("\n\n", table_of_settings(), "\n\n")))
      << "worlds/README.md should have this table:\n"
      << table_of_settings();
}

}  // namespace
}  // namespace tessera
