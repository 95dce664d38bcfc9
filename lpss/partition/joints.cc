#include "lpss/partition/joints.h"

#include <algorithm>
#include <utility>

#include "lpss/partition/bodies.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

void set_apart(Partition& partition, const JointTie& joint, bool apart) {
  if (!joint.bodies_collide && joint.parent.value != 0)
    partition.engine.set_apart(joint.parent, joint.child, apart);
}

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

bool is_coupled_with_record(const Partition& partition, JointId id) {
  return std::ranges::any_of(partition.joints.coupled(id),
                             [&](JointId other) { return partition.joints.record(other) != nullptr; });
}

bool holds_body_here(const Partition& partition, const JointTie& joint) {
  return partition.bodies.contains(joint.child) || partition.bodies.contains(joint.parent);
}

// Forgets of a joint what need not be known here any more.
void review(Partition& partition, JointId id) {
  const JointTie* found = partition.joints.find(id);
  if (found == nullptr) return;
  const JointTie joint = *found;
  if (partition.joints.record(id) != nullptr && !partition.bodies.contains(joint.child)) {
    const std::span<const JointId> listed = partition.joints.coupled(id);
    const std::vector<JointId> coupled(listed.begin(), listed.end());
    partition.joints.release(id);
    for (const JointId other : coupled) {
      if (partition.joints.record(other) == nullptr) review(partition, other);
    }
  }
  if (holds_body_here(partition, joint) || is_coupled_with_record(partition, id) ||
      all_know_joints(partition.settings)) {
    return;
  }
  partition.joints.remove(id);
  set_apart(partition, joint, false);
}

}  // namespace

bool all_know_joints(const WorldSettings& settings) { return seam_rules(settings.seams).clones_are_solved(); }

void take_tie(Partition& partition, const JointTie& tie) {
  if (partition.joints.add(tie)) set_apart(partition, tie, true);
}

void add_joint(Partition& partition, const JointRecord& record, std::span<const JointTie> leaders) {
  const JointTie tie = tie_of(record);
  for (const JointAxis& axis : axes_of(record.properties)) {
    if (axis.mimic.is_set() && partition.joints.record(axis.mimic.leader) != nullptr)
      partition.joints.couple(record.id, axis.mimic.leader);
  }
  if (!holds_body_here(partition, tie) && !is_coupled_with_record(partition, record.id) &&
      !all_know_joints(partition.settings)) {
    return;
  }
  take_tie(partition, tie);
  if (partition.bodies.contains(tie.child)) {
    for (const JointTie& leader : leaders) take_tie(partition, leader);
    partition.joints.keep(record);
  }
  note_joint(partition, tie.parent);
  note_joint(partition, tie.child);
  wake_jointed(partition, tie);
}

// Those with their children here come first: what is coupled with them is known by them.
void add_joints(Partition& partition, std::span<const JointRecord> records) {
  for (const bool has_child : {true, false}) {
    for (const JointRecord& record : records) {
      if (partition.bodies.contains(record.properties.child) == has_child) add_joint(partition, record);
    }
  }
}

void remove_joint(Partition& partition, JointId id) {
  const JointTie* found = partition.joints.find(id);
  if (found == nullptr) return;
  const JointTie joint = *found;
  wake_jointed(partition, joint);
  const std::span<const JointId> listed = partition.joints.coupled(id);
  const std::vector<JointId> coupled(listed.begin(), listed.end());
  partition.joints.remove(id);
  set_apart(partition, joint, false);
  note_joint(partition, joint.parent);
  note_joint(partition, joint.child);
  for (const JointId other : coupled) review(partition, other);
}

void remove_joints_of(Partition& partition, BodyId body) {
  const std::span<const JointId> listed = partition.joints.of(body);
  for (const JointId id : std::vector<JointId>(listed.begin(), listed.end())) remove_joint(partition, id);
}

void set_drives(Partition& partition, JointId id, const JointDrives& drives, AxisMask axes) {
  const JointTie* joint = partition.joints.find(id);
  if (joint == nullptr) return;
  if (JointRecord* record = partition.joints.record(id)) {
    for (std::size_t n = 0; n < drives.size(); ++n) {
      if ((axes >> n & 1) != 0) record->drives[n] = drives[n];
    }
    partition.set_joints.push_back(id);
  }
  wake_jointed(partition, *joint);
}

BodyJoints joints_of(const Partition& partition, BodyId body) {
  BodyJoints joints;
  for (const JointId id : partition.joints.of(body)) {
    const JointTie& tie = *partition.joints.find(id);
    if (tie.child != body) {
      joints.as_parent.push_back(tie);
      continue;
    }
    HeldJoint& held = joints.as_child.emplace_back(HeldJoint{*partition.joints.record(id), {}});
    for (const JointId other : partition.joints.coupled(id)) {
      if (const JointTie* coupled = partition.joints.find(other)) held.coupled.push_back(*coupled);
    }
  }
  return joints;
}

void take_joints(Partition& partition, const BodyJoints& joints) {
  for (const JointTie& tie : joints.as_parent) take_tie(partition, tie);
  for (const HeldJoint& held : joints.as_child) {
    take_tie(partition, tie_of(held.record));
    partition.joints.keep(held.record);
    for (const JointTie& other : held.coupled) {
      take_tie(partition, other);
      partition.joints.couple(held.record.id, other.id);
    }
  }
}

void leave_joints(Partition& partition, BodyId body) {
  const std::span<const JointId> listed = partition.joints.of(body);
  partition.left_joints.insert(partition.left_joints.end(), listed.begin(), listed.end());
}

void review_joints(Partition& partition) {
  for (const JointId id : std::exchange(partition.left_joints, {})) review(partition, id);
}

void wake_jointed(Partition& partition, const JointTie& joint) {
  const auto wake = [&](BodyId id) {
    const auto found = partition.bodies.find(id);
    if (found == partition.bodies.end()) return;
    wake_home(partition, *found->second);
  };
  for_each_tied(partition.joints, joint, joint.child, wake);
  wake(joint.child);
}

bool is_everywhere(bool jointed, Motion motion, const OffsetSet& replicated_in) {
  return (jointed && motion == Motion::kKinematic) || !replicated_in.far().empty();
}

bool is_pushed_by(const Partition& partition, const JointTie& joint) {
  if (joint.parent_motion != Motion::kKinematic) return false;
  if (const auto body = partition.bodies.find(joint.parent); body != partition.bodies.end()) {
    return body->second->sector->world->activity(body->second->slot) != Activity::kAsleep;
  }
  const auto replica = partition.replicas.find(joint.parent);
  return replica != partition.replicas.end() && replica->second->state.activity != Activity::kAsleep;
}

}  // namespace tessera
