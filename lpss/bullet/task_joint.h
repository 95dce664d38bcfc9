// The joint of a task as the joint solver takes it.
#pragma once

#include "lpss/bullet/joint_assembly.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// While bodies of the task store their places in the solver as companion ids.
SolvedJoint solved_joint(const TaskJoint& joint);

}  // namespace tessera::bullet
