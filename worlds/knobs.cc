#include "worlds/knobs.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <limits>
#include <type_traits>

#include "lpss/model/validate.h"

namespace tessera {
namespace {

// Calls `visit(name, value)` for each knob, until it returns false.
template <typename AnyKnobs, typename Visit>
void visit_knobs(AnyKnobs& k, const Visit& visit) {
  (void)(visit("precision", k.precision) && visit("sector_size", k.sector_size) &&
         visit("time_step", k.time_step) && visit("seams", k.seams) && visit("clone_depth", k.clone_depth) &&
         visit("island_cap", k.island_cap) && visit("shuffle", k.shuffle) &&
         visit("solver_iterations", k.solver_iterations) && visit("substeps", k.substeps) &&
         visit("adapt", k.adapt) && visit("warm_starting", k.warm_starting) &&
         visit("split_from", k.split_from) &&
         visit("friction_in_two_directions", k.friction_in_two_directions) &&
         visit("continuous_collision", k.continuous_collision) &&
         visit("sleep_linear_speed", k.sleep_linear_speed) &&
         visit("sleep_angular_speed", k.sleep_angular_speed) && visit("sleep_after", k.sleep_after));
}

template <typename T>
bool read(const nlohmann::ordered_json& json, std::optional<T>& value) {
  if constexpr (std::is_same_v<T, bool>) {
    if (!json.is_boolean()) return false;
    value = json.get<bool>();
  } else if constexpr (std::is_same_v<T, Precision>) {
    if (json.is_string()) value = precision_named(json.get<std::string>());
    return json.is_string() && value;
  } else if constexpr (std::is_same_v<T, SeamPolicy>) {
    if (json.is_string()) value = seams_named(json.get<std::string>());
    return json.is_string() && value;
  } else if constexpr (std::is_integral_v<T>) {
    const bool is_natural =
        json.is_number_unsigned() || (json.is_number_integer() && json.get<std::int64_t>() >= 0);
    if (!is_natural || json.get<std::uint64_t>() > std::numeric_limits<T>::max()) return false;
    value = json.get<T>();
  } else {
    if (!json.is_number()) return false;
    value = json.get<T>();
  }
  return true;
}

constexpr long double kReachMax = 0x1p40L;  // m; a long double still resolves 2^-24 m there

// One axis: the offset in new sectors from the anchor, and what is left over.
struct Cut {
  std::int64_t sectors;
  double local;
};

absl::StatusOr<Cut> cut(std::int64_t offset, double local, double old_size, double new_size) {
  const long double metres = static_cast<long double>(offset) * old_size + local;
  if (!(std::abs(metres) <= kReachMax)) {
    return absl::OutOfRangeError(
        "is more than 2^40 m from the anchor, too far to be put into sectors of another size");
  }
  const long double sectors = std::floor(metres / new_size + 0.5L);
  if (std::abs(sectors) > kReachMax)
    return absl::OutOfRangeError("is more than 2^40 sectors from the anchor");
  return Cut{static_cast<std::int64_t>(sectors), static_cast<double>(metres - sectors * new_size)};
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

absl::Status apply(const Knobs& knobs, WorldDescription& world) {
  WorldSettings& s = world.settings;
  const auto set = [](const auto& knob, auto& setting) {
    if (knob) setting = *knob;
  };
  set(knobs.precision, s.precision);
  set(knobs.time_step, s.time_step);
  set(knobs.seams, s.seams);
  set(knobs.clone_depth, s.clone_depth);
  set(knobs.island_cap, s.island_cap);
  set(knobs.shuffle, s.shuffle);
  set(knobs.solver_iterations, s.solver_iterations);
  set(knobs.substeps, s.substeps);
  set(knobs.adapt, s.adapt);
  set(knobs.warm_starting, s.warm_starting);
  set(knobs.split_from, s.split_from);
  set(knobs.friction_in_two_directions, s.friction_in_two_directions);
  set(knobs.continuous_collision, s.continuous_collision);
  set(knobs.sleep_linear_speed, s.sleep_linear_speed);
  set(knobs.sleep_angular_speed, s.sleep_angular_speed);
  set(knobs.sleep_after, s.sleep_after);
  return knobs.sector_size ? change_sector_size(world, *knobs.sector_size) : absl::OkStatus();
}

nlohmann::ordered_json to_json(const Knobs& knobs) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  visit_knobs(knobs, [&](const char* name, const auto& value) {
    using Value = std::decay_t<decltype(*value)>;
    if constexpr (std::is_enum_v<Value>) {
      if (value) json[name] = name_of(*value);
    } else {
      if (value) json[name] = *value;
    }
    return true;
  });
  return json;
}

absl::StatusOr<Knobs> knobs_from_json(const nlohmann::ordered_json& json) {
  if (!json.is_object()) return absl::InvalidArgumentError("settings are an object of names and values");
  Knobs knobs;
  for (const auto& [name, value] : json.items()) {
    bool exists = false;
    bool fits = false;
    visit_knobs(knobs, [&, &name = name, &value = value](const char* candidate, auto& knob) {
      exists = name == candidate;
      if (exists) fits = read(value, knob);
      return !exists;
    });
    if (!exists) return absl::InvalidArgumentError(absl::StrCat("there is no setting \"", name, "\""));
    if (!fits)
      return absl::InvalidArgumentError(absl::StrCat("setting \"", name, "\" cannot be ", value.dump()));
  }
  return knobs;
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
