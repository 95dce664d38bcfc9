#include "lpss/tick/island_assembly.h"

#include <algorithm>
#include <tuple>

#include "lpss/base/invariant.h"
#include "lpss/partition/near_seam.h"

namespace tessera {

std::unique_ptr<IslandSolver> SolverPool::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<IslandSolver> solver = std::move(idle_.back());
      idle_.pop_back();
      return solver;
    }
  }
  return engine_.make_solver();
}

void SolverPool::put_back(std::unique_ptr<IslandSolver> solver) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(solver));
}

void TaskBuilder::add_clone(const WorldBody& place, BodyId original) { clones_.push_back({original, place}); }

void TaskBuilder::sort_bodies() {
  std::sort(bodies_.begin(), bodies_.end(), [](const Body& a, const Body& b) { return a.id < b.id; });
}

const TaskBuilder::Body* TaskBuilder::find(BodyId id) const {
  const auto body = std::lower_bound(bodies_.begin(), bodies_.end(), id,
                                     [](const Body& b, BodyId wanted) { return b.id < wanted; });
  return body != bodies_.end() && body->id == id ? &*body : nullptr;
}

std::optional<std::size_t> TaskBuilder::place_of(BodyId id) const {
  const Body* body = find(id);
  if (body == nullptr) return std::nullopt;
  return static_cast<std::size_t>(body - bodies_.data());
}

void TaskBuilder::add_joints(const JointIndex& joints, double sector_size, bool complete,
                             const FixParent& fix_parent) {
  sort_bodies();
  for (const Body& child : bodies_) {
    if (!child.own) continue;
    for (const JointId id : joints.of(child.id)) {
      const JointRecord& joint = *joints.find(id);
      if (joint.properties.child != child.id) continue;
      TaskJoint task;
      task.properties = &joint.properties;
      task.drives = &joint.drives;
      task.child = child.place;
      if (joint.parent_motion == Motion::kDynamic) {
        const Body* parent = find(joint.properties.parent);
        invariant(parent != nullptr || !complete, "both bodies of a joint belong to the same island");
        if (parent == nullptr) continue;
        task.parent = parent->place;
        task.parent_origin = metres_between(child.frame, parent->frame, sector_size);
      } else {
        fix_parent(joint, child.frame, task);
      }
      joints_.emplace_back(id, task);
    }
  }
  std::sort(joints_.begin(), joints_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
}

SolveJob TaskBuilder::build() {
  SolveJob job;
  sort_bodies();
  std::sort(contacts_.begin(), contacts_.end(),
            [](const Contact& a, const Contact& b) { return std::tie(a.a, a.b) < std::tie(b.a, b.b); });
  job.task.bodies.reserve(bodies_.size());
  for (const Body& body : bodies_) job.task.bodies.push_back(body.place);
  job.task.contacts.reserve(contacts_.size());
  for (const Contact& contact : contacts_) job.task.contacts.push_back(contact.place);
  for (const auto& [id, joint] : joints_) job.task.joints.push_back(joint);
  for (const auto& [original, place] : clones_) {
    const Body* body = find(original);
    invariant(body != nullptr, "the original of a clone belongs to the same island");
    job.task.clones.push_back({place, static_cast<std::size_t>(body - bodies_.data())});
  }
  job.kinematics = std::move(kinematics_);
  return job;
}

SectorWorld& Carriers::world_of(const SectorIndex& sector) {
  std::unique_ptr<SectorWorld>& world = worlds_[sector];
  if (!world) world = engine_.make_world();
  return *world;
}

Carriers::Carriers(Engine& engine, double sector_size, const std::vector<const ShippedIsland*>& shipped,
                   const absl::flat_hash_map<BodyId, BodyRecord>& own, TaskBuilder& builder)
    : engine_(engine) {
  absl::flat_hash_map<BodyId, BodyRecord> records = own;
  std::vector<const ShippedContact*> contacts;
  for (const ShippedIsland* island : shipped) {
    for (const ShippedBody& body : island->bodies) {
      const BodyId id = body.record.id;
      if (!records.try_emplace(id, body.record).second) continue;  // kinematic, and shipped by two servers
      if (body.record.properties.motion != Motion::kDynamic) continue;
      SectorWorld& world = world_of(body.record.home);
      const WorldBody place{&world, world.add(body.record, Role::kHome)};
      world.set_total_wrench(place.slot, body.wrench);
      homes_[id] = {body.record.home, place};
      builder.add_body(id, place, body.record.home);
    }
    for (const ShippedContact& contact : island->contacts) contacts.push_back(&contact);
  }
  std::sort(contacts.begin(), contacts.end(), [](const ShippedContact* x, const ShippedContact* y) {
    return std::tie(x->sector, x->manifold.a, x->manifold.b) <
           std::tie(y->sector, y->manifold.a, y->manifold.b);
  });

  // Gives a side of a contact a body in the carrier of the sector that detected it.
  absl::flat_hash_set<std::pair<SectorIndex, BodyId>> present;
  const auto provide = [&](const SectorIndex& sector, SectorWorld& world, BodyId id) {
    const auto home = homes_.find(id);
    if (home != homes_.end() && home->second.home == sector) return;
    if (!present.insert({sector, id}).second) return;
    const auto known = records.find(id);
    if (known == records.end()) {
      // A static body: the solver looks at none of its properties but that it does not move.
      BodyProperties fixed;
      fixed.motion = Motion::kStatic;
      world.add_static(id, fixed, Shape{{ShapePart{Sphere{0.5}, {}}}}, {});
      return;
    }
    BodyRecord record = known->second;
    Eigen::Map<Eigen::Vector3d>(record.state.position.data()) +=
        metres_between(sector, record.home, sector_size);
    const WorldBody place{&world, world.add(record, Role::kClone)};
    if (record.properties.motion == Motion::kDynamic) builder.add_clone(place, id);
  };
  for (const ShippedContact* contact : contacts) {
    SectorWorld& world = world_of(contact->sector);
    provide(contact->sector, world, contact->manifold.a);
    provide(contact->sector, world, contact->manifold.b);
    world.adopt_manifold(contact->manifold);
    const std::span<const ContactPair> pairs = world.contacts();
    const WorldPair place{&world, pairs.size() - 1};
    builder.add_contact(pairs.back(), place);
    contacts_.push_back({contact->sector, place});
  }
}

void Carriers::collect(const SectorMap& map, std::vector<Solution>& outbox) const {
  for (const auto& [id, carried] : homes_) {
    outbox[map.owner(carried.home)].bodies.push_back({id, carried.place.world->state(carried.place.slot)});
  }
  for (const auto& [sector, place] : contacts_) {
    outbox[map.owner(sector)].contacts.push_back({sector, place.world->export_manifold(place.pair)});
  }
}

}  // namespace tessera
