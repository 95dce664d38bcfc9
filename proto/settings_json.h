// Settings as JSON, under the names that kSettings gives them.
#pragma once

#include <nlohmann/json.hpp>

#include "lpss/model/settings.h"

namespace tessera {

nlohmann::ordered_json value_of(const WorldSetting& setting, const WorldSettings& settings);

// False, and nothing changes, for a value of another kind, or one that the setting's type cannot hold.
bool set_from_json(const WorldSetting& setting, const nlohmann::ordered_json& value, WorldSettings& settings);

// All settings of the list.
nlohmann::ordered_json to_json(const WorldSettings& settings);

}  // namespace tessera
