// Joints of a share: they tie bodies of any two sectors into one island, and wake what they tie.
#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

JointSide side_of(const BodyState& state) {
  return {{Eigen::Vector3d(state.position.data()), quaternion_of(state)},
          Eigen::Vector3d(state.linear_velocity.data()),
          Eigen::Vector3d(state.angular_velocity.data())};
}

}  // namespace

void Share::add_joint(const JointRecord& record) {
  const JointProperties& joint = record.properties;
  joints_.add(record);
  if (!joint.bodies_collide && joint.parent.value != 0) engine_.set_apart(joint.parent, joint.child, true);
  note_joint(joint.parent);
  note_joint(joint.child);
  wake_jointed(record);
}

void Share::remove_joint(JointId id) {
  const JointRecord* found = joints_.find(id);
  if (found == nullptr) return;
  const JointRecord record = *found;
  const JointProperties& joint = record.properties;
  wake_jointed(record);
  joints_.remove(id);
  if (!joint.bodies_collide && joint.parent.value != 0) engine_.set_apart(joint.parent, joint.child, false);
  note_joint(joint.parent);
  note_joint(joint.child);
}

void Share::remove_joints_of(BodyId body) {
  const std::span<const JointId> listed = joints_.of(body);
  for (const JointId id : std::vector<JointId>(listed.begin(), listed.end())) remove_joint(id);
}

void Share::set_drives(const SetDrives& command) {
  JointRecord* joint = joints_.find(command.id);
  if (joint == nullptr) return;
  joint->drives = command.drives;
  wake_jointed(*joint);
}

void Share::note_joint(BodyId body) {
  const auto found = bodies_.find(body);
  if (found == bodies_.end()) return;
  HomeBody& noted = *found->second;
  noted.jointed = !joints_.of(body).empty();
  world_of(*noted.sector).set_jointed(noted.slot, noted.jointed);
}

// What hangs on a joint that changes must notice.
void Share::wake_jointed(const JointRecord& joint) {
  for (const BodyId id : {joint.properties.parent, joint.properties.child}) {
    const auto found = bodies_.find(id);
    if (found == bodies_.end()) continue;
    HomeBody& body = *found->second;
    if (body.properties.motion == Motion::kDynamic) body.sector->world->wake(body.slot);
    body.news = true;
    activate(*body.sector);
  }
}

// A kinematic body may lead a joint whose other side lives anywhere, so all shares are told where it is.
bool Share::is_everywhere(const HomeBody& body) const {
  return body.jointed && body.properties.motion == Motion::kKinematic;
}

// Whether the joint's parent is kinematic and on its way: it lets nothing sleep that hangs on it.
bool Share::is_pushed_by(const JointRecord& joint) const {
  if (joint.parent_motion != Motion::kKinematic) return false;
  if (const auto body = bodies_.find(joint.properties.parent); body != bodies_.end()) {
    return body->second->sector->world->activity(body->second->slot) != Activity::kAsleep;
  }
  const auto ghost = ghosts_.find(joint.properties.parent);
  return ghost != ghosts_.end() && ghost->second->state.activity != Activity::kAsleep;
}

bool Share::is_dynamic(BodyId body, const JointRecord& joint) const {
  return body == joint.properties.child || joint.parent_motion == Motion::kDynamic;
}

// Both sides of a joint that runs over a border name both of its bodies.
void Share::link_joints(const Sector& sector, const Component& component, std::vector<BodyId>& links) const {
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    const HomeBody& body = *sector.component_bodies[i];
    if (!body.jointed) continue;
    for (const JointId id : joints_.of(body.id)) {
      const JointRecord& joint = *joints_.find(id);
      const BodyId partner = partner_of(joint.properties, body.id);
      if (partner.value == 0 || !is_dynamic(partner, joint) || lives_in(partner, sector)) continue;
      links.push_back(body.id);
      links.push_back(partner);
    }
  }
  std::sort(links.begin(), links.end());
  links.erase(std::unique(links.begin(), links.end()), links.end());
}

// The dynamic parents of a component's bodies that live in other sectors.
std::vector<BodyId> Share::far_parents(const Sector& sector, const Component& component) const {
  std::vector<BodyId> parents;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    const HomeBody& body = *sector.component_bodies[i];
    if (!body.jointed) continue;
    for (const JointId id : joints_.of(body.id)) {
      const JointRecord& joint = *joints_.find(id);
      const BodyId parent = joint.properties.parent;
      if (parent == body.id || joint.parent_motion != Motion::kDynamic || lives_in(parent, sector)) continue;
      parents.push_back(parent);
    }
  }
  return parents;
}

// Where the joint frame is on the side of a parent that no solver moves, seen from the sector `frame`.
void Share::fix_parent(const JointRecord& record, const SectorIndex& frame, TaskJoint& task) const {
  const JointProperties& joint = record.properties;
  SectorIndex home = joint.anchor;
  JointSide parent;
  if (joint.parent.value != 0) {
    if (record.parent_motion == Motion::kStatic) {
      const BodyRecord* body = statics_.find(joint.parent);
      invariant(body != nullptr, "the static parent of a joint is there as long as the joint");
      home = body->home;
      parent = side_of(body->state);
    } else if (const auto body = bodies_.find(joint.parent); body != bodies_.end()) {
      home = body->second->sector->index;
      parent = side_of(body->second->sector->world->state(body->second->slot));
    } else {
      const auto ghost = ghosts_.find(joint.parent);
      invariant(ghost != ghosts_.end(), "all shares know a kinematic body that a joint hangs on");
      home = ghost->second->home;
      parent = side_of(ghost->second->state);
    }
  }
  const Eigen::Vector3d lever = parent.pose.orientation * joint.in_parent.position;
  task.fixed_parent = parent.pose * joint.in_parent;
  task.fixed_parent.position += metres_between(frame, home, size());
  task.fixed_velocity = parent.linear_velocity + parent.angular_velocity.cross(lever);
  task.fixed_spin = parent.angular_velocity;
}

// A task with the joints of its bodies. Policy clone: those that have both of their bodies in the sector.
SolveJob Share::built(TaskBuilder& builder) const {
  if (!joints_.empty()) {
    builder.add_joints(joints_, size(), options_.settings.seams == SeamPolicy::kIsland,
                       [&](const JointRecord& joint, const SectorIndex& frame, TaskJoint& task) {
                         fix_parent(joint, frame, task);
                       });
  }
  return builder.build();
}

}  // namespace tessera
