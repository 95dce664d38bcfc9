#include "lpss/model/settings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "lpss/model/validate.h"

namespace tessera {
namespace {

const WorldSetting& named(absl::string_view name) { return *find_setting(name); }

// Converts to whatever a member is, so that an aggregate can be tried with any number of them.
struct Anything {
  template <typename T>
  operator T() const;
};

template <typename Struct, typename... Members>
constexpr std::size_t members_of() {
  if constexpr (requires { Struct{std::declval<Members>()..., Anything{}}; }) {
    return members_of<Struct, Members..., Anything>();
  } else {
    return sizeof...(Members);
  }
}

static_assert(members_of<WorldSettings>() == kSettings.size() + 3,
              "all but gravity, frames and modules are in the list");

TEST(SettingsTest, EachHasANameAMemberAndAHelpOfItsOwn) {
  std::set<std::string_view> names;
  for (const WorldSetting& setting : kSettings) {
    names.insert(setting.name);
    EXPECT_STRNE(setting.help, "") << setting.name;
    EXPECT_EQ(find_setting(setting.name), &setting);
    for (const WorldSetting& other : kSettings) {
      EXPECT_EQ(setting.member == other.member, &setting == &other) << setting.name << " " << other.name;
    }
  }
  EXPECT_EQ(names.size(), kSettings.size());
  EXPECT_EQ(find_setting("gravity"), nullptr);
}

TEST(SettingsTest, ThoseOfThePolicyCloneComeLast) {
  EXPECT_TRUE(std::ranges::is_sorted(kSettings, {}, &WorldSetting::of_policy_clone));
  EXPECT_TRUE(named("clone_depth").of_policy_clone);
  EXPECT_FALSE(named("substeps").of_policy_clone);
}

TEST(SettingsTest, DefaultsAreValidAndSurviveAsText) {
  EXPECT_TRUE(validate(WorldSettings()).ok());
  for (const WorldSetting& setting : kSettings) {
    WorldSettings settings;
    EXPECT_TRUE(set_from_text(setting, text_of(setting, settings), settings).ok()) << setting.name;
    EXPECT_EQ(text_of(setting, settings), text_of(setting, WorldSettings())) << setting.name;
  }
}

TEST(SettingsTest, ReadsEveryKind) {
  WorldSettings settings;
  EXPECT_TRUE(set_from_text(named("precision"), "f64", settings).ok());
  EXPECT_TRUE(set_from_text(named("seams"), "clone", settings).ok());
  EXPECT_TRUE(set_from_text(named("adapt"), "false", settings).ok());
  EXPECT_TRUE(set_from_text(named("substeps"), "1e1", settings).ok());
  EXPECT_TRUE(set_from_text(named("shuffle"), "18446744073709551615", settings).ok());
  EXPECT_EQ(settings.precision, Precision::kFloat64);
  EXPECT_EQ(settings.seams, SeamPolicy::kClone);
  EXPECT_FALSE(settings.adapt);
  EXPECT_EQ(settings.substeps, 10);
  EXPECT_EQ(settings.shuffle, ~std::uint64_t{0});
}

TEST(SettingsTest, SaysWhatAValueMustBe) {
  const auto message = [](absl::string_view name, absl::string_view text) {
    WorldSettings settings;
    const absl::Status status = set_from_text(named(name), text, settings);
    EXPECT_EQ(text_of(named(name), settings), text_of(named(name), WorldSettings())) << name;
    return std::string(status.message());
  };
  EXPECT_EQ(message("precision", "f16"), "'f16' must be f32 or f64");
  EXPECT_EQ(message("adapt", "maybe"), "'maybe' must be true or false");
  EXPECT_EQ(message("substeps", "1.5"), "'1.5' must be an integer of 1 to 64");
  EXPECT_EQ(message("shuffle", "often"), "'often' must be an integer of 0 or more");
  EXPECT_EQ(message("warm_starting", "nan"), "'nan' must be a number of 0 to 1");
}

}  // namespace
}  // namespace tessera
