// The tables in docs/programs.md say what programs say.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "lpss/programs/registry.h"

namespace tessera {
namespace {

void append_rows(absl::string_view what, std::span<const NumberSpec> table, bool is_bounded,
                 std::string& text) {
  constexpr std::ptrdiff_t kManyAlike = 8;  // that mean the same are one row
  for (auto first = table.begin(); first != table.end();) {
    const NumberSpec& spec = *first;
    const auto end = std::find_if(first, table.end(),
                                  [&](const NumberSpec& other) { return other.meaning != spec.meaning; });
    const bool is_list = end - first >= kManyAlike;
    const std::string names = is_list ? absl::StrCat("`", spec.name, "` to `", std::prev(end)->name, "`")
                                      : absl::StrCat("`", spec.name, "`");
    first = is_list ? end : std::next(first);
    const std::string unit = spec.unit.empty() ? "" : absl::StrCat(spec.unit, " ");
    const std::string bounds =
        is_bounded ? absl::StrCat(spec.first, " | ", spec.least, " to ", spec.most) : " | ";
    absl::StrAppend(&text, "| ", what, " ", names, " | ", spec.meaning, " | ", unit, "| ", bounds, " |\n");
  }
}

std::string section_of(const Program& program) {
  std::string text =
      absl::StrCat("### ", program.kind(), "\n\n", program.summary(),
                   "\n\n| number | meaning | unit | at first | bounds |\n|---|---|---|---|---|\n");
  append_rows("parameter", program.parameters(), true, text);
  append_rows("input", program.inputs(), true, text);
  append_rows("value", program.values(), false, text);
  return text;
}

TEST(ProgramsDocumentation, TablesAreThoseOfThePrograms) {
  std::ifstream in(std::filesystem::path(TESSERA_SOURCE_DOCS) / "programs.md");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  for (const Program* program : programs()) {
    const std::string section = section_of(*program);
    EXPECT_TRUE(absl::StrContains(text, absl::StrCat("\n\n", section, "\n")))
        << "docs/programs.md should have this section:\n"
        << section;
  }
}

}  // namespace
}  // namespace tessera
