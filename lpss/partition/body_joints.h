// What travels of joints with a body that they hold.
#pragma once

#include <vector>

#include "lpss/model/joint.h"

namespace tessera {

// A joint at the home of its child.
struct HeldJoint {
  JointRecord record;
  std::vector<JointTie> coupled;  // that its axes follow, and that follow it; ascending by ids
};

struct BodyJoints {
  std::vector<HeldJoint> as_child;  // ascending by ids
  std::vector<JointTie> as_parent;  // likewise

  bool empty() const { return as_child.empty() && as_parent.empty(); }
};

}  // namespace tessera
