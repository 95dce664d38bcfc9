#include "lpss/partition/joints.h"

#include "lpss/partition/bodies.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

void note_joint(Partition& partition, BodyId body) {
  const auto found = partition.bodies.find(body);
  if (found == partition.bodies.end()) return;
  HomeBody& noted = *found->second;
  noted.jointed = !partition.joints.of(body).empty();
  world_of(partition, *noted.sector).set_jointed(noted.slot, noted.jointed);
  if (noted.jointed) {
    partition.jointed.insert(body);
  } else {
    partition.jointed.erase(body);
  }
}

}  // namespace

void add_joint(Partition& partition, const JointRecord& record) {
  const JointProperties& joint = record.properties;
  partition.joints.add(record);
  if (!joint.bodies_collide && joint.parent.value != 0)
    partition.engine.set_apart(joint.parent, joint.child, true);
  note_joint(partition, joint.parent);
  note_joint(partition, joint.child);
  wake_jointed(partition, record);
}

void remove_joint(Partition& partition, JointId id) {
  const JointRecord* found = partition.joints.find(id);
  if (found == nullptr) return;
  const JointRecord record = *found;
  const JointProperties& joint = record.properties;
  wake_jointed(partition, record);
  partition.joints.remove(id);
  if (!joint.bodies_collide && joint.parent.value != 0)
    partition.engine.set_apart(joint.parent, joint.child, false);
  note_joint(partition, joint.parent);
  note_joint(partition, joint.child);
}

void remove_joints_of(Partition& partition, BodyId body) {
  const std::span<const JointId> listed = partition.joints.of(body);
  for (const JointId id : std::vector<JointId>(listed.begin(), listed.end())) remove_joint(partition, id);
}

void set_drives(Partition& partition, JointId id, const JointDrives& drives) {
  JointRecord* joint = partition.joints.find(id);
  if (joint == nullptr) return;
  joint->drives = drives;
  wake_jointed(partition, *joint);
}

void wake_jointed(Partition& partition, const JointRecord& joint) {
  const auto wake = [&](BodyId id) {
    const auto found = partition.bodies.find(id);
    if (found == partition.bodies.end()) return;
    HomeBody& body = *found->second;
    if (body.properties.motion == Motion::kDynamic) body.sector->world->wake(body.slot);
    mark_dirty(body);
    activate(partition, *body.sector);
  };
  for_each_tied(partition.joints, joint, joint.properties.child, wake);
  wake(joint.properties.child);
}

bool is_everywhere(const HomeBody& body) {
  return body.jointed && body.properties.motion == Motion::kKinematic;
}

bool is_pushed_by(const Partition& partition, const JointRecord& joint) {
  if (joint.parent_motion != Motion::kKinematic) return false;
  if (const auto body = partition.bodies.find(joint.properties.parent); body != partition.bodies.end()) {
    return body->second->sector->world->activity(body->second->slot) != Activity::kAsleep;
  }
  const auto replica = partition.replicas.find(joint.properties.parent);
  return replica != partition.replicas.end() && replica->second->state.activity != Activity::kAsleep;
}

}  // namespace tessera
