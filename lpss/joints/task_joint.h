// The joint of a task as the joint solver takes it.
#pragma once

#include <optional>

#include "lpss/engine/engine.h"
#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

// `child` and `parent` are the sides of the joint as their worlds have them; no parent if nothing moves it.
PosedJoint posed(const TaskJoint& joint, const JointSide& child, const std::optional<JointSide>& parent);

}  // namespace tessera::joints
