// The surface of a link: friction, bouncing, and how it moves.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <sdf/Collision.hh>
#include <sdf/Link.hh>
#include <string>
#include <vector>

#include "lpss/model/body.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// In a <link>, how libsdformat passes on what it says, in numbers.
inline constexpr absl::string_view kSurfaceMotion = "tessera:surface_motion";

// In a <collision>: it is a trigger. Empty, or true or false.
inline constexpr absl::string_view kTrigger = "tessera:trigger";

// Checks <tessera:trigger> of an element, which must be a <collision>, and keeps it as 0 or 1,
// as libsdformat passes on what is true or false.
absl::Status keep_trigger(xml::Element& element);

bool is_trigger(const sdf::Collision& collision);

// Checks <tessera:surface_motion velocity="x y z" running="x y z"/> of a <link>, and keeps it as numbers.
absl::Status keep_surface_motion(xml::Element& link);

// What turns the directions of a frame, by its name, into those of a link; none if the frame may move
// otherwise than the link, or is not there.
using TurnOfFrame = std::function<std::optional<Eigen::Quaterniond>(const std::string& name)>;

// The materials of the collisions of a link, in their order: directions are in the frame of the link.
std::vector<PartMaterial> materials_of(const sdf::Link& link, const TurnOfFrame& turn_of, Notices& notices);

// A body has the surface of its first collision, all bits of its collisions, and the motion that the link
// says; it is a trigger if all of them are.
void set_surface(const sdf::Link& link, const std::vector<PartMaterial>& materials,
                 BodyProperties& properties);

}  // namespace tessera
