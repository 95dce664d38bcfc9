#include "worlds/loader/world_settings.h"

#include "lpss/model/validate.h"
#include "worlds/loader/elements.h"
#include "worlds/loader/tessera_elements.h"

namespace tessera {
namespace {

using xml::Element;

absl::Status read_physics(const Element& physics, WorldSettings& settings, Notices& notices) {
  for (const Element* child = physics.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    note_unread(*child, notices);
  }
  if (const Element* step = physics.FirstChildElement("max_step_size")) {
    const absl::StatusOr<double> value = xml::number_of(*step);
    if (!value.ok()) return value.status();
    settings.time_step = *value;
  }
  // Before SDF 1.6 the gravity was in this element.
  if (const Element* gravity = physics.FirstChildElement("gravity")) {
    const absl::StatusOr<Eigen::Vector3d> value = xml::vector_in(*gravity, xml::text_of(*gravity));
    if (!value.ok()) return value.status();
    settings.gravity = UniformGravity{*value};
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status read_world_settings(const xml::Element& world, WorldSettings& settings, Notices& notices) {
  if (const Element* gravity = world.FirstChildElement("gravity")) {
    const absl::StatusOr<Eigen::Vector3d> value = xml::vector_in(*gravity, xml::text_of(*gravity));
    if (!value.ok()) return value.status();
    settings.gravity = UniformGravity{*value};
  }
  const Element* physics = world.FirstChildElement("physics");
  for (const Element* other = physics; other != nullptr; other = other->NextSiblingElement("physics")) {
    if (other->BoolAttribute("default", false)) physics = other;
    if (other->NextSiblingElement("physics") != nullptr)
      notices.count("<physics> beside the default one, skipped");
  }
  if (physics != nullptr) {
    if (absl::Status status = read_physics(*physics, settings, notices); !status.ok()) return status;
  }
  if (const Element* own = world.FirstChildElement("tessera:settings")) {
    if (absl::Status status = read_settings(*own, settings); !status.ok()) return status;
  }
  // From here on every position is converted to sectors, so L must be valid.
  if (absl::Status status = validate(settings); !status.ok())
    return xml::error_at(world, status.code(), status.message());
  if (const Element* planet = world.FirstChildElement("tessera:central_gravity")) {
    absl::StatusOr<CentralGravity> gravity = read_central_gravity(*planet, settings.sector_size);
    if (!gravity.ok()) return gravity.status();
    settings.gravity = *gravity;
    if (absl::Status status = validate(settings); !status.ok())
      return xml::error_at(*planet, status.code(), status.message());
  }
  return absl::OkStatus();
}

}  // namespace tessera
