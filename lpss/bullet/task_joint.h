// The joint of a task as the joint solver takes it.
#pragma once

#include <optional>

#include "lpss/bullet/joint_assembly.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// `child` and `parent` are the sides of the joint as their worlds have them; no parent if nothing moves it.
PosedJoint posed(const TaskJoint& joint, const JointSide& child, const std::optional<JointSide>& parent);

}  // namespace tessera::bullet
