#include "client_sdk/cli/world_overrides.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <utility>

#include "lpss/world/validate.h"

namespace tessera::cli {
namespace {

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

absl::StatusOr<LoadedWorld> load_world(const std::filesystem::path& file, const WorldOverrides& overrides) {
  absl::StatusOr<LoadedWorld> loaded = load_world_file(file);
  if (!loaded.ok()) return loaded.status();
  WorldDescription& world = loaded->world;
  WorldSettings& settings = world.settings;
  if (overrides.precision) settings.precision = *overrides.precision;
  if (overrides.time_step) settings.time_step = *overrides.time_step;
  if (overrides.seams) settings.seams = *overrides.seams;
  if (overrides.clone_depth) settings.clone_depth = *overrides.clone_depth;
  if (overrides.island_cap) settings.island_cap = *overrides.island_cap;
  if (overrides.shuffle) settings.shuffle = *overrides.shuffle;
  if (overrides.sector_size) {
    if (absl::Status status = change_sector_size(world, *overrides.sector_size); !status.ok()) return status;
  }
  if (absl::Status status = move_by(world, overrides.shift); !status.ok()) return in("--shift", status);
  if (absl::Status status = validate(world); !status.ok()) return status;
  return loaded;
}

}  // namespace tessera::cli
