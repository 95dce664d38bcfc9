#include "lpss/tick/island_task.h"

#include <algorithm>
#include <tuple>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"

namespace tessera {

void TaskBuilder::begin_island(int substeps) {
  substeps_ = substeps;
  is_given_ = substeps > 0;
  members_.clear();
  bodies_.clear();
  contacts_.clear();
  guests_.clear();
}

std::uint32_t TaskBuilder::add_member(const Member& member) {
  members_.push_back(member);
  return static_cast<std::uint32_t>(members_.size() - 1);
}

void TaskBuilder::add(const Sector& sector, const Component& component) {
  SectorWorld* const world = sector.world.get();
  const bool clones_stand = !partition_->rules.clones_are_solved();
  const auto bodies = std::span(sector.component_bodies)
                          .subspan(component.bodies_begin, component.bodies_end - component.bodies_begin);
  const auto clones = std::span(sector.component_clones)
                          .subspan(component.clones_begin, component.clones_end - component.clones_begin);
  for (const HomeBody* body : bodies)
    member_in(body->slot) = add_member({body->id, {world, body->slot}, sector.index, body->jointed});
  for (const Clone* clone : clones) {
    member_in(clone->slot) =
        add_member({clone->replica->id, {world, clone->slot}, sector.index, false, clones_stand});
  }
  const std::span<const ContactPair> pairs = world->contacts();
  for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
    const std::uint32_t n = sector.component_pairs[i];
    const ContactPair& pair = pairs[n];
    contacts_.push_back({pair.a, pair.b, {world, n}, member_in(pair.slot_a), member_in(pair.slot_b)});
    if (!is_given_) substeps_ = std::max<int>(substeps_, pair.substeps);
  }
  for (const HomeBody* body : bodies) member_in(body->slot) = kNone;
  for (const Clone* clone : clones) member_in(clone->slot) = kNone;
}

void TaskBuilder::add_body(const ShippedIsland& parcel, std::size_t n) {
  const ShippedBody& body = parcel.bodies[n];
  const auto slot = static_cast<BodySlot>(job_.task.shipped_bodies.size());
  job_.task.shipped_bodies.push_back(numbers_of_body(parcel, n));
  add_member({body.id, {nullptr, slot}, body.home});
}

// Whom it concerns is known once all bodies have been added.
void TaskBuilder::add_pair(const ShippedIsland& parcel, std::size_t n) {
  const ShippedPair& pair = parcel.pairs[n];
  const auto place = static_cast<std::uint32_t>(job_.task.shipped_pairs.size());
  job_.task.shipped_pairs.push_back(numbers_of_pair(parcel, n));
  contacts_.push_back({pair.a, pair.b, {nullptr, place}, kNone, kNone});
}

void TaskBuilder::end_island() {
  place_members();
  order_contacts();
  add_joints();
  SolveTask& task = job_.task;
  task.islands.push_back({task.bodies.size(), task.contacts.size(), task.joints.size(), substeps_});
}

const TaskBuilder::Member* TaskBuilder::find(BodyId id) const {
  const auto body =
      std::lower_bound(bodies_.begin(), bodies_.end(), id,
                       [this](std::uint32_t n, BodyId wanted) { return members_[n].id < wanted; });
  return body != bodies_.end() && members_[*body].id == id ? &members_[*body] : nullptr;
}

std::optional<std::size_t> TaskBuilder::place_of(BodyId id) const {
  const Member* body = find(id);
  if (body == nullptr) return std::nullopt;
  const std::size_t islands = job_.task.islands.size();
  return body->in_task + (islands > 1 ? job_.task.islands[islands - 2].bodies : 0);
}

void TaskBuilder::place_members() {
  for (std::uint32_t n = 0; n < members_.size(); ++n) {
    if (!members_[n].stands_for) bodies_.push_back(n);
  }
  const auto by_id = [this](std::uint32_t x, std::uint32_t y) { return members_[x].id < members_[y].id; };
  if (!std::is_sorted(bodies_.begin(), bodies_.end(), by_id))
    std::sort(bodies_.begin(), bodies_.end(), by_id);
  for (std::uint32_t n = 0; n < bodies_.size(); ++n) {
    members_[bodies_[n]].in_task = n;
    job_.task.bodies.push_back(members_[bodies_[n]].place);
    job_.bodies.push_back(members_[bodies_[n]].id);
  }
  for (Member& member : members_) {
    if (!member.stands_for) continue;
    const Member* original = find(member.id);
    invariant(original != nullptr, "the original of a clone belongs to the same island");
    member.in_task = original->in_task;
    member.frame = original->frame;
  }
}

void TaskBuilder::order_contacts() {
  const auto by_ids = [](const Contact& x, const Contact& y) {
    return std::tie(x.a, x.b) < std::tie(y.a, y.b);
  };
  if (!std::is_sorted(contacts_.begin(), contacts_.end(), by_ids))
    std::sort(contacts_.begin(), contacts_.end(), by_ids);
  SolveTask& task = job_.task;
  const auto first = static_cast<std::uint32_t>(task.bodies.size() - bodies_.size());
  to_order_.clear();
  for (Contact& contact : contacts_) {
    const auto member = [&](BodyId id, std::uint32_t known) -> const Member* {
      if (contact.pair.world == nullptr) return find(id);
      return known != kNone ? &members_[known] : nullptr;
    };
    const Member* const a = member(contact.a, contact.member_a);
    const Member* const b = member(contact.b, contact.member_b);
    ContactToOrder& entry = to_order_.emplace_back();
    if (a != nullptr) contact.pair.a = first + (entry.a = a->in_task);
    if (b != nullptr) contact.pair.b = first + (entry.b = b->in_task);
    const bool is_fixed = a == nullptr || b == nullptr;
    entry.stage = is_fixed ? kFixedStage : stage_of(a->frame, b->frame, partition_->anchor);
  }
  for (const std::uint32_t n : order_.of(to_order_, bodies_.size()))
    task.contacts.push_back(contacts_[n].pair);
}

SolveJob TaskBuilder::build() {
  SolveOrder::stage_ends(to_order_, job_.task.contacts.size() - contacts_.size(), job_.stage_ends);
  return std::move(job_);
}

void TaskBuilder::add_joints() {
  std::vector<IslandJoint>& joints = job_.task.joints;
  const auto first = static_cast<std::ptrdiff_t>(joints.size());
  if (!partition_->joints.empty()) {
    for (const std::uint32_t n : bodies_) {
      const Member& child = members_[n];
      if (!child.has_joints) continue;
      for_each_of_child(partition_->joints, child.id,
                        [&](const JointRecord& joint) { add_joint(joint, child); });
    }
  }
  for (const JointRecord* joint : guests_) {
    const Member* child = find(joint->properties.child);
    invariant(child != nullptr, "a joint is shipped with its child");
    add_joint(*joint, *child);
  }
  std::sort(joints.begin() + first, joints.end(),
            [](const IslandJoint& a, const IslandJoint& b) { return a.id < b.id; });
}

void TaskBuilder::add_joint(const JointRecord& joint, const Member& child) {
  const std::size_t first = job_.task.bodies.size() - bodies_.size();
  IslandJoint task;
  task.id = joint.id;
  task.form = &joint.properties;
  task.drives = &joint.drives;
  task.child = first + child.in_task;
  if (joint.parent_motion == Motion::kDynamic) {
    const Member* parent = find(joint.properties.parent);
    invariant(parent != nullptr || partition_->rules.clones_are_solved(),
              "both bodies of a joint belong to the same island");
    if (parent == nullptr) return;
    task.parent = first + parent->in_task;
    task.parent_origin = metres_between(child.frame, parent->frame, partition_->sector_size());
  } else {
    fix_parent(joint, child.frame, task);
  }
  job_.task.joints.push_back(task);
}

// Where the joint frame is on the side of a parent that no solver moves, seen from the sector `frame`.
void TaskBuilder::fix_parent(const JointRecord& record, const SectorIndex& frame, IslandJoint& joint) const {
  const JointProperties& properties = record.properties;
  SectorIndex home = properties.anchor;
  JointSide parent;
  if (properties.parent.value != 0) {
    if (record.parent_motion == Motion::kStatic) {
      const BodyRecord* body = partition_->statics.find(properties.parent);
      invariant(body != nullptr, "the static parent of a joint is there as long as the joint");
      home = body->home;
      parent = side_of(body->state);
    } else if (const auto body = partition_->bodies.find(properties.parent);
               body != partition_->bodies.end()) {
      home = body->second->sector->index;
      parent = side_of(body->second->sector->world->state(body->second->slot));
    } else {
      const auto replica = partition_->replicas.find(properties.parent);
      invariant(replica != partition_->replicas.end(),
                "all servers know a kinematic body that is the parent of a joint");
      home = replica->second->home;
      parent = side_of(replica->second->state);
    }
  }
  joint.fix_parent(parent, metres_between(frame, home, partition_->sector_size()));
}

}  // namespace tessera
