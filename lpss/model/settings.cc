#include "lpss/model/settings.h"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace tessera {
namespace {

template <typename Enum>
std::string words_of(Enum any) {
  return absl::StrJoin(all_of(any), " or ",
                       [](std::string* text, Enum one) { absl::StrAppend(text, name_of(one)); });
}

bool read(absl::string_view text, bool& value) { return absl::SimpleAtob(text, &value); }
bool read(absl::string_view text, double& value) {
  return absl::SimpleAtod(text, &value) && std::isfinite(value);
}
bool read(absl::string_view text, std::uint64_t& value) { return absl::SimpleAtoi(text, &value); }

// Also 1e3 and 4.0.
bool read(absl::string_view text, int& value) {
  double number = 0;
  if (!read(text, number) || number != std::floor(number) || number < std::numeric_limits<int>::min() ||
      number > std::numeric_limits<int>::max()) {
    return false;
  }
  value = static_cast<int>(number);
  return true;
}

template <typename Enum>
requires std::is_enum_v<Enum>
bool read(absl::string_view text, Enum& value) {
  const auto& all = all_of(value);
  const auto found = std::ranges::find_if(all, [text](Enum one) { return text == name_of(one); });
  if (found == all.end()) return false;
  value = *found;
  return true;
}

// What a value must be, before its bounds.
template <typename Value>
const char* kind_of(const Value&) {
  if constexpr (std::is_enum_v<Value> || std::is_same_v<Value, bool>) return "";
  if constexpr (std::is_floating_point_v<Value>) return "a number of ";
  return "an integer of ";
}

}  // namespace

const WorldSetting* find_setting(absl::string_view name) {
  const auto found =
      std::ranges::find_if(kSettings, [name](const WorldSetting& one) { return name == one.name; });
  return found == kSettings.end() ? nullptr : &*found;
}

absl::Status set_from_text(const WorldSetting& setting, absl::string_view text, WorldSettings& settings) {
  return std::visit(
      [&](const auto member) -> absl::Status {
        auto value = settings.*member;
        if (!read(text, value)) {
          return absl::InvalidArgumentError(
              absl::StrCat("'", text, "' must be ", kind_of(value), bounds_of(setting)));
        }
        settings.*member = value;
        return absl::OkStatus();
      },
      setting.member);
}

std::string text_of(const WorldSetting& setting, const WorldSettings& settings) {
  return std::visit(
      [&](const auto member) -> std::string {
        using Value = std::remove_cvref_t<decltype(settings.*member)>;
        if constexpr (std::is_enum_v<Value>) {
          return name_of(settings.*member);
        } else if constexpr (std::is_same_v<Value, bool>) {
          return settings.*member ? "true" : "false";
        } else {
          return absl::StrCat(settings.*member);
        }
      },
      setting.member);
}

std::string bounds_of(const WorldSetting& setting) {
  return std::visit(
      [&](const auto member) -> std::string {
        using Value = std::remove_cvref_t<decltype(WorldSettings{}.*member)>;
        if constexpr (std::is_enum_v<Value>) {
          return words_of(Value{});
        } else if constexpr (std::is_same_v<Value, bool>) {
          return "true or false";
        } else {
          const auto text = [](double bound) { return absl::StrCat(static_cast<Value>(bound)); };
          if (setting.most == kNoBound) return absl::StrCat(text(setting.least), " or more");
          return absl::StrCat(text(setting.least), " to ", text(setting.most));
        }
      },
      setting.member);
}

double way_from_home_max(const WorldSettings& settings) {
  return 4 * settings.sector_size + 6 * kSpeedMax * settings.time_step;
}

}  // namespace tessera
