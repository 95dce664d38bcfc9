#include "lpss/world/world_description.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>

namespace tessera {
namespace {

constexpr const char* kPrecisionNames[] = {"f32", "f64"};
constexpr const char* kSeamsNames[] = {"island", "clone"};

template <typename T, std::size_t n>
std::optional<T> named(const char* const (&names)[n], const std::string& name) {
  const auto found = std::find(std::begin(names), std::end(names), name);
  if (found == std::end(names)) return std::nullopt;
  return static_cast<T>(found - std::begin(names));
}

absl::Status in(const std::string& what, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(what, ": ", status.message()));
}

}  // namespace

const char* name_of(Precision precision) { return kPrecisionNames[static_cast<int>(precision)]; }
const char* name_of(SeamPolicy seams) { return kSeamsNames[static_cast<int>(seams)]; }
std::optional<Precision> precision_named(const std::string& name) { return named<Precision>(kPrecisionNames, name); }
std::optional<SeamPolicy> seams_named(const std::string& name) { return named<SeamPolicy>(kSeamsNames, name); }

absl::Status move_by(WorldDescription& world, const SectorOffset& offset) {
  const absl::StatusOr<SectorIndex> anchor = translated(world.anchor, offset);
  if (!anchor.ok()) return in("the world's anchor", anchor.status());

  CentralGravity* planet = std::get_if<CentralGravity>(&world.settings.gravity);
  absl::StatusOr<SectorIndex> planet_sector = SectorIndex{};
  if (planet != nullptr) {
    planet_sector = translated(planet->centre.sector, offset);
    if (!planet_sector.ok()) return in("the centre of central gravity", planet_sector.status());
  }
  for (const BodyDescription& body : world.bodies) {
    const absl::StatusOr<SectorIndex> moved = translated(body.pose.position.sector, offset);
    if (!moved.ok()) return in(absl::StrCat("body '", body.name, "'"), moved.status());
  }
  for (const JointDescription& joint : world.joints) {
    if (joint.properties.parent.value != 0) continue;
    const absl::StatusOr<SectorIndex> moved = translated(joint.properties.anchor, offset);
    if (!moved.ok()) return in(absl::StrCat("joint '", joint.name, "'"), moved.status());
  }

  world.anchor = *anchor;
  if (planet != nullptr) planet->centre.sector = *planet_sector;
  for (BodyDescription& body : world.bodies) {
    body.pose.position.sector = *translated(body.pose.position.sector, offset);
  }
  for (JointDescription& joint : world.joints) {
    if (joint.properties.parent.value != 0) continue;
    joint.properties.anchor = *translated(joint.properties.anchor, offset);
  }
  return absl::OkStatus();
}

}  // namespace tessera
