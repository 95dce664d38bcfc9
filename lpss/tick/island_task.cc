#include "lpss/tick/island_task.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/inlined_vector.h>

#include <algorithm>
#include <numeric>
#include <tuple>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"

namespace tessera {

void TaskBuilder::add_clone(const WorldBody& place, BodyId original) { clones_.push_back({original, place}); }

void TaskBuilder::sort_bodies() {
  std::sort(bodies_.begin(), bodies_.end(), [](const Body& a, const Body& b) { return a.id < b.id; });
}

const TaskBuilder::Body* TaskBuilder::find(BodyId id) const {
  const auto body = std::lower_bound(bodies_.begin(), bodies_.end(), id,
                                     [](const Body& b, BodyId wanted) { return b.id < wanted; });
  return body != bodies_.end() && body->id == id ? &*body : nullptr;
}

void TaskBuilder::add_joint(const JointRecord& joint, const Body& child, double sector_size, bool complete,
                            const FixParent& fix_parent) {
  TaskJoint task;
  task.id = joint.id;
  task.properties = &joint.properties;
  task.drives = &joint.drives;
  task.child = child.place;
  if (joint.parent_motion == Motion::kDynamic) {
    const Body* parent = find(joint.properties.parent);
    invariant(parent != nullptr || !complete, "both bodies of a joint belong to the same island");
    if (parent == nullptr) return;
    task.parent = parent->place;
    task.parent_origin = metres_between(child.frame, parent->frame, sector_size);
  } else {
    fix_parent(joint, child.frame, task);
  }
  joints_.emplace_back(joint.id, task);
}

void TaskBuilder::add_joints(const JointIndex& joints, std::span<const JointRecord> guests,
                             double sector_size, bool complete, const FixParent& fix_parent) {
  sort_bodies();
  for (const Body& child : bodies_) {
    if (!child.own) continue;
    for (const JointId id : joints.of(child.id)) {
      const JointRecord* joint = joints.record(id);
      if (joint != nullptr && joint->properties.child == child.id)
        add_joint(*joint, child, sector_size, complete, fix_parent);
    }
  }
  for (const JointRecord& joint : guests) {
    const Body* child = find(joint.properties.child);
    invariant(child != nullptr, "a joint is shipped with its child");
    add_joint(joint, *child, sector_size, complete, fix_parent);
  }
  std::sort(joints_.begin(), joints_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
}

// The places in the task of bodies and of clones that stand for them, by world and slot.
class TaskBuilder::Places {
 public:
  static constexpr std::uint32_t kNone = ContactToOrder::kFixed;

  void set(const WorldBody& body, std::size_t place) {
    Slots& slots = slots_of(body.world);
    const auto slot = static_cast<std::size_t>(body.slot);
    if (slot >= slots.size()) slots.resize(slot + 1, kNone);
    slots[slot] = static_cast<std::uint32_t>(place);
  }

  std::uint32_t of(SectorWorld* world, BodySlot slot) {
    const Slots& slots = slots_of(world);
    return static_cast<std::size_t>(slot) < slots.size() ? slots[static_cast<std::size_t>(slot)] : kNone;
  }

 private:
  using Slots = absl::InlinedVector<std::uint32_t, 6>;

  Slots& slots_of(SectorWorld* world) {
    if (world != last_) {
      last_ = world;
      last_slots_ = &worlds_[world];
    }
    return *last_slots_;
  }

  absl::flat_hash_map<SectorWorld*, Slots> worlds_;
  SectorWorld* last_ = nullptr;
  Slots* last_slots_ = nullptr;
};

std::vector<ContactToOrder> TaskBuilder::contacts_to_order(Places& places, const SectorIndex& anchor) const {
  std::vector<ContactToOrder> contacts;
  contacts.reserve(contacts_.size());
  for (const Contact& contact : contacts_) {
    const std::uint32_t a = places.of(contact.place.world, contact.slot_a);
    const std::uint32_t b = places.of(contact.place.world, contact.slot_b);
    const bool is_fixed = a == Places::kNone || b == Places::kNone;
    contacts.push_back({is_fixed ? kFixedGroup : group_of(bodies_[a].frame, bodies_[b].frame, anchor), a, b});
  }
  return contacts;
}

std::optional<std::size_t> TaskBuilder::place_of(BodyId id) const {
  const Body* body = find(id);
  if (body == nullptr) return std::nullopt;
  return static_cast<std::size_t>(body - bodies_.data());
}

SolveJob TaskBuilder::build(const SectorIndex& anchor) {
  SolveJob job;
  sort_bodies();
  const auto by_ids = [](const Contact& x, const Contact& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
  };
  if (!std::is_sorted(contacts_.begin(), contacts_.end(), by_ids)) {
    std::sort(contacts_.begin(), contacts_.end(), by_ids);
  }
  Places places;
  job.task.bodies.reserve(bodies_.size());
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    job.task.bodies.push_back(bodies_[n].place);
    places.set(bodies_[n].place, n);
  }
  for (const auto& [original, place] : clones_) {
    const Body* body = find(original);
    invariant(body != nullptr, "the original of a clone belongs to the same island");
    job.task.clones.push_back({place, static_cast<std::size_t>(body - bodies_.data())});
    places.set(place, job.task.clones.back().original);
  }
  job.task.contacts.reserve(contacts_.size());
  const std::vector<ContactToOrder> contacts = contacts_to_order(places, anchor);
  job.group_ends.assign(kContactGroups, 0);
  for (const ContactToOrder& contact : contacts) ++job.group_ends[contact.group];
  std::partial_sum(job.group_ends.begin(), job.group_ends.end(), job.group_ends.begin());
  for (const std::uint32_t n : solve_order(contacts, bodies_.size()))
    job.task.contacts.push_back(contacts_[n].place);
  for (const auto& [id, joint] : joints_) {
    job.task.joints.push_back(joint);
    job.joints.push_back(id);
  }
  job.kinematics = std::move(kinematics_);
  return job;
}

namespace {

JointSide side_of(const BodyState& state) {
  return {{Eigen::Vector3d(state.position.data()), quaternion_of(state)},
          Eigen::Vector3d(state.linear_velocity.data()),
          Eigen::Vector3d(state.angular_velocity.data())};
}

// Where the joint frame is on the side of a parent that no solver moves, seen from the sector `frame`.
void fix_parent(const Partition& partition, const JointRecord& record, const SectorIndex& frame,
                TaskJoint& task) {
  const JointProperties& joint = record.properties;
  SectorIndex home = joint.anchor;
  JointSide parent;
  if (joint.parent.value != 0) {
    if (record.parent_motion == Motion::kStatic) {
      const BodyRecord* body = partition.statics.find(joint.parent);
      invariant(body != nullptr, "the static parent of a joint is there as long as the joint");
      home = body->home;
      parent = side_of(body->state);
    } else if (const auto body = partition.bodies.find(joint.parent); body != partition.bodies.end()) {
      home = body->second->sector->index;
      parent = side_of(body->second->sector->world->state(body->second->slot));
    } else {
      const auto replica = partition.replicas.find(joint.parent);
      invariant(replica != partition.replicas.end(),
                "all servers know a kinematic body that is the parent of a joint");
      home = replica->second->home;
      parent = side_of(replica->second->state);
    }
  }
  const Eigen::Vector3d lever = parent.pose.orientation * joint.in_parent.position;
  task.fixed_parent = parent.pose * joint.in_parent;
  task.fixed_parent.position += metres_between(frame, home, partition.sector_size());
  task.fixed_velocity = parent.linear_velocity + parent.angular_velocity.cross(lever);
  task.fixed_spin = parent.angular_velocity;
}

}  // namespace

void add_component(const Partition& partition, Sector& sector, const Component& component,
                   TaskBuilder& builder, bool clones_as_bodies) {
  SectorWorld& world = *sector.world;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    builder.add_body(sector.component_bodies[i]->id, {&world, sector.component_bodies[i]->slot},
                     sector.index);
  }
  for (std::uint32_t i = component.clones_begin; i < component.clones_end; ++i) {
    const Clone& clone = *sector.component_clones[i];
    const BodyId id = clone.replica->id;
    const WorldBody place{&world, clone.slot};
    if (clones_as_bodies) {
      builder.add_guest(id, place, sector.index);
    } else {
      builder.add_clone(place, id);
    }
  }
  const std::span<const ContactPair> pairs = world.contacts();
  for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
    const ContactPair& pair = pairs[sector.component_pairs[i]];
    builder.add_contact(pair, {&world, sector.component_pairs[i]});
    if (!sector.has_kinematics) continue;
    if (motion_of(partition, pair.a) == Motion::kKinematic) builder.add_kinematic({&world, pair.slot_a});
    if (motion_of(partition, pair.b) == Motion::kKinematic) builder.add_kinematic({&world, pair.slot_b});
  }
}

SolveJob build_job(const Partition& partition, TaskBuilder& builder, std::span<const JointRecord> guests) {
  if (!partition.joints.empty() || !guests.empty()) {
    builder.add_joints(partition.joints, guests, partition.sector_size(),
                       partition.settings.seams == SeamPolicy::kIsland,
                       [&](const JointRecord& joint, const SectorIndex& frame, TaskJoint& task) {
                         fix_parent(partition, joint, frame, task);
                       });
  }
  return builder.build(partition.anchor);
}

}  // namespace tessera
