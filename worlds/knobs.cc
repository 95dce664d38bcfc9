#include "worlds/knobs.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/model/validate.h"
#include "proto/settings_json.h"

namespace tessera {
namespace {

constexpr double kReachMax = 0x1p40;  // m, and sectors

// One axis: the offset in new sectors from the anchor, and what is left over.
struct Cut {
  std::int64_t sectors;
  double local;
};

// In twice the digits of double precision, so that all that is left over is kept.
absl::StatusOr<Cut> cut(std::int64_t offset, double local, double old_size, double new_size) {
  const auto whole = static_cast<double>(offset);  // exact within reach
  const double start = whole * old_size;
  const double metres = start + local;
  if (!(std::abs(metres) <= kReachMax)) {
    return absl::OutOfRangeError(
        "is more than 2^40 m from the anchor, too far to be put into sectors of another size");
  }
  const double of_local = metres - start;
  const double rest =
      std::fma(whole, old_size, -start) + ((start - (metres - of_local)) + (local - of_local));
  const double sectors = std::floor(metres / new_size + 0.5);
  if (std::abs(sectors) > kReachMax)
    return absl::OutOfRangeError("is more than 2^40 sectors from the anchor");
  return Cut{static_cast<std::int64_t>(sectors), std::fma(-sectors, new_size, metres) + rest};
}

absl::StatusOr<WorldPosition> recut(const WorldPosition& position, const SectorIndex& anchor, double old_size,
                                    double new_size) {
  const absl::StatusOr<SectorOffset> offset = offset_between(anchor, position.sector);
  if (!offset.ok()) return offset.status();
  const absl::StatusOr<Cut> x = cut(offset->i, position.local.x(), old_size, new_size);
  if (!x.ok()) return x.status();
  const absl::StatusOr<Cut> y = cut(offset->j, position.local.y(), old_size, new_size);
  if (!y.ok()) return y.status();
  const absl::StatusOr<Cut> z = cut(offset->k, position.local.z(), old_size, new_size);
  if (!z.ok()) return z.status();
  const absl::StatusOr<SectorIndex> sector = translated(anchor, {x->sectors, y->sectors, z->sectors});
  if (!sector.ok()) return sector.status();
  return canonical(*sector, {x->local, y->local, z->local}, new_size);
}

absl::Status in(const std::string& what, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(what, ": ", status.message()));
}

}  // namespace

std::size_t Knobs::place_of(const WorldSetting::Member& member) {
  const auto found = std::ranges::find(kSettings, member, &WorldSetting::member);
  invariant(found != kSettings.end(), "a knob is a setting of the list");
  return static_cast<std::size_t>(found - kSettings.begin());
}

absl::Status Knobs::set_from_text(const WorldSetting& setting, absl::string_view text) {
  absl::Status status = tessera::set_from_text(setting, text, values_);
  if (status.ok()) is_set_[place_of(setting.member)] = true;
  return status;
}

bool Knobs::set_from_json(const WorldSetting& setting, const nlohmann::ordered_json& value) {
  if (!tessera::set_from_json(setting, value, values_)) return false;
  is_set_[place_of(setting.member)] = true;
  return true;
}

absl::Status apply(const Knobs& knobs, WorldDescription& world) {
  const double old_size = world.settings.sector_size;
  for (const WorldSetting& setting : kSettings) {
    if (!knobs.has(setting)) continue;
    std::visit([&](const auto member) { world.settings.*member = knobs.values().*member; }, setting.member);
  }
  // What is in the sectors still lies in those of the old size.
  return change_sector_size(world, std::exchange(world.settings.sector_size, old_size));
}

nlohmann::ordered_json to_json(const Knobs& knobs) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const WorldSetting& setting : kSettings) {
    if (knobs.has(setting)) json[setting.name] = value_of(setting, knobs.values());
  }
  return json;
}

absl::StatusOr<Knobs> knobs_from_json(const nlohmann::ordered_json& json) {
  if (!json.is_object()) return absl::InvalidArgumentError("settings are an object of names and values");
  Knobs knobs;
  for (const auto& [name, value] : json.items()) {
    const WorldSetting* setting = find_setting(name);
    if (setting == nullptr)
      return absl::InvalidArgumentError(absl::StrCat("there is no setting \"", name, "\""));
    if (knobs.set_from_json(*setting, value)) continue;
    // Those may be nested as deep as they like: too deep to be printed.
    const std::string what = value.is_structured() ? absl::StrCat("an ", value.type_name()) : value.dump();
    return absl::InvalidArgumentError(absl::StrCat("setting \"", name, "\" cannot be ", what));
  }
  return knobs;
}

absl::StatusOr<Knobs> knobs_from_text(std::string_view text) {
  if (text.size() > kSettingsFileBytesMax) {
    return absl::InvalidArgumentError(
        absl::StrCat("a file of settings must have at most ", kSettingsFileBytesMax, " bytes"));
  }
  const auto json =
      nlohmann::ordered_json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return absl::InvalidArgumentError("it is not JSON");
  return knobs_from_json(json);
}

absl::Status change_sector_size(WorldDescription& world, double sector_size) {
  const double old_size = world.settings.sector_size;
  if (sector_size == old_size) return absl::OkStatus();
  WorldSettings settings = world.settings;
  settings.sector_size = sector_size;
  if (absl::Status status = validate(settings); !status.ok()) return status;

  if (CentralGravity* planet = std::get_if<CentralGravity>(&world.settings.gravity)) {
    const auto centre = recut(planet->centre, world.anchor, old_size, sector_size);
    if (!centre.ok()) return in("the centre of central gravity", centre.status());
    planet->centre = *centre;
  }
  for (BodyDescription& body : world.bodies) {
    const auto position = recut(body.pose.position, world.anchor, old_size, sector_size);
    if (!position.ok()) return in(absl::StrCat("body '", body.name, "'"), position.status());
    body.pose.position = *position;
  }
  for (JointDescription& joint : world.joints) {
    JointProperties& properties = joint.properties;
    if (properties.parent.value != 0) continue;
    const WorldPosition there{properties.anchor, properties.in_parent.position};
    const auto position = recut(there, world.anchor, old_size, sector_size);
    if (!position.ok()) return in(absl::StrCat("joint '", joint.name, "'"), position.status());
    properties.anchor = position->sector;
    properties.in_parent.position = position->local;
  }
  world.settings.sector_size = sector_size;
  return absl::OkStatus();
}

}  // namespace tessera
