// The knobs of a world, apart from the world: what a command line, a file of settings or a search changes.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <bitset>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <type_traits>

#include "lpss/model/world_description.h"

namespace tessera {

// Settings that are to change; the others stay as the world has them.
class Knobs {
 public:
  template <typename T>
  void set(T WorldSettings::*member, std::type_identity_t<T> value) {
    values_.*member = value;
    is_set_[place_of(member)] = true;
  }
  template <typename T>
  std::optional<T> get(T WorldSettings::*member) const {
    return is_set_[place_of(member)] ? std::optional<T>(values_.*member) : std::nullopt;
  }

  bool any() const { return is_set_.any(); }
  bool has(const WorldSetting& setting) const { return is_set_[place_of(setting.member)]; }
  // Of what is not set: the default.
  const WorldSettings& values() const { return values_; }

  // As set_from_text() and set_from_json() of settings.
  absl::Status set_from_text(const WorldSetting& setting, absl::string_view text);
  bool set_from_json(const WorldSetting& setting, const nlohmann::ordered_json& value);

 private:
  static std::size_t place_of(const WorldSetting::Member& member);

  WorldSettings values_;
  std::bitset<kSettings.size()> is_set_;  // by place in the list
};

// Changes the world's settings; with another sector size everything stays where it is. Bounds are checked by
// validate(), except those of a sector size. Errors as change_sector_size().
absl::Status apply(const Knobs& knobs, WorldDescription& world);

// An object of what is to change, by the names of kSettings.
nlohmann::ordered_json to_json(const Knobs& knobs);
// INVALID_ARGUMENT, naming the setting, for one that does not exist or is of another kind.
absl::StatusOr<Knobs> knobs_from_json(const nlohmann::ordered_json& json);
// The same for text. INVALID_ARGUMENT also for what is no JSON, or larger than kSettingsFileBytesMax.
inline constexpr std::size_t kSettingsFileBytesMax = std::size_t{64} << 10;
absl::StatusOr<Knobs> knobs_from_text(std::string_view text);

// The same world in sectors of another size: everything stays where it is, measured from the anchor's centre.
// OUT_OF_RANGE, naming the body or joint, for what is too far from there to be placed to the micrometre
// (2^40 m). INVALID_ARGUMENT for a size that is out of bounds.
absl::Status change_sector_size(WorldDescription& world, double sector_size);

}  // namespace tessera
