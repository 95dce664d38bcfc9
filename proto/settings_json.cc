#include "proto/settings_json.h"

#include <limits>
#include <string>
#include <type_traits>

namespace tessera {

nlohmann::ordered_json value_of(const WorldSetting& setting, const WorldSettings& settings) {
  return std::visit(
      [&](const auto member) -> nlohmann::ordered_json {
        if constexpr (std::is_enum_v<std::remove_cvref_t<decltype(settings.*member)>>) {
          return name_of(settings.*member);
        } else {
          return settings.*member;
        }
      },
      setting.member);
}

bool set_from_json(const WorldSetting& setting, const nlohmann::ordered_json& json, WorldSettings& settings) {
  return std::visit(
      [&](const auto member) {
        auto& value = settings.*member;
        using Value = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<Value, bool>) {
          if (!json.is_boolean()) return false;
        } else if constexpr (std::is_enum_v<Value>) {
          return json.is_string() && set_from_text(setting, json.get<std::string>(), settings).ok();
        } else if constexpr (std::is_integral_v<Value>) {
          const bool is_natural =
              json.is_number_unsigned() || (json.is_number_integer() && json.get<std::int64_t>() >= 0);
          if (!is_natural || json.get<std::uint64_t>() > std::numeric_limits<Value>::max()) return false;
        } else {
          if (!json.is_number()) return false;
        }
        if constexpr (!std::is_enum_v<Value>) value = json.get<Value>();
        return true;
      },
      setting.member);
}

nlohmann::ordered_json to_json(const WorldSettings& settings) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const WorldSetting& setting : kSettings) json[setting.name] = value_of(setting, settings);
  return json;
}

}  // namespace tessera
