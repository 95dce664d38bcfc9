#include "lpss/partition/properties.h"

#include <vector>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/statics.h"

namespace tessera {
namespace {

void set_static_properties(Partition& partition, BodyId id, const BodyProperties& properties) {
  invariant(properties.motion == Motion::kStatic, "a static body stays one");
  BodyRecord record = *partition.statics.find(id);
  record.properties = properties;
  remove_static_body(partition, id);
  add_static_body(partition, record);
}

// Joints whose parent a body is must know whether a solver moves it.
void set_motion_in_joints(Partition& partition, BodyId id, Motion motion) {
  const std::span<const JointId> listed = partition.joints.of(id);
  for (const JointId joint : std::vector<JointId>(listed.begin(), listed.end())) {
    if (partition.joints.find(joint)->parent == id) partition.joints.set_parent_motion(joint, motion);
    wake_jointed(partition, *partition.joints.find(joint));
  }
}

}  // namespace

void set_properties(Partition& partition, BodyId id, const BodyProperties& properties) {
  if (partition.statics.find(id) != nullptr) {
    set_static_properties(partition, id, properties);
  } else {
    invariant(properties.motion != Motion::kStatic, "a body that can move does not become static");
    // Its home tells of it in this tick, and the clones come back.
    lift_clones(partition, id);
    if (partition.replicas.contains(id)) introduce(partition, {id, properties});
    if (const auto found = partition.bodies.find(id); found != partition.bodies.end())
      set_home_properties(partition, *found->second, properties);
  }
  set_motion_in_joints(partition, id, properties.motion);
}

}  // namespace tessera
