// Joints between models, beside them in a <world> (SDF 1.10).
#pragma once

#include <absl/functional/function_ref.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>

#include "lpss/grid/world_position.h"
#include "worlds/loader/joint_reader.h"
#include "worlds/loader/model_source.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// Rewrites the axes of a <joint> that are expressed in another frame into its own, which has this
// orientation in the world. Errors: those of `frame_named`; INVALID_ARGUMENT for a vector that is none.
absl::Status express_axes(
    xml::Element& joint, const Eigen::Quaterniond& orientation,
    absl::FunctionRef<absl::StatusOr<WorldPose>(const xml::Element&, const std::string&)> frame_named);

// The type, axes and drives of a <joint> in the world of a file in `directory`. Its axes must be expressed in
// its own frame. The element is changed: it moves into a model of its own. `notices` gets what is left out;
// none if that is the joint itself. INVALID_ARGUMENT, naming the place.
absl::StatusOr<std::optional<JointKind>> read_world_joint(xml::Element& joint, const std::string& version,
                                                          const std::filesystem::path& directory,
                                                          ModelSources& sources, Notices& notices);

}  // namespace tessera
