#include "lpss/tick/ship.h"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <tuple>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"

namespace tessera {

void ship_part(const Partition& partition, const Sector& sector, const Component& component,
               ShippedIsland& parcel) {
  SectorWorld& world = *sector.world;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    const HomeBody& body = *sector.component_bodies[i];
    parcel.bodies.push_back({record_of(body), world.total_wrench(body.slot)});
    if (!body.jointed) continue;
    for (const JointId id : partition.joints.of(body.id)) {
      if (const JointRecord* joint = partition.joints.record(id);
          joint != nullptr && joint->properties.child == body.id)
        parcel.joints.push_back(*joint);
    }
  }
  const std::span<const ContactPair> pairs = world.contacts();
  for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
    const ContactPair& pair = pairs[sector.component_pairs[i]];
    parcel.contacts.push_back({sector.index, world.export_manifold(sector.component_pairs[i])});
    if (!sector.has_kinematics) continue;
    for (const BodyId id : {pair.a, pair.b}) {
      if (motion_of(partition, id) != Motion::kKinematic) continue;
      if (const auto body = partition.bodies.find(id); body != partition.bodies.end()) {
        parcel.bodies.push_back({record_of(*body->second), {}});
      } else {
        const Replica& replica = *partition.replicas.at(id);
        parcel.bodies.push_back({{id, replica.home, replica.properties, replica.state}, {}});
      }
    }
  }
}

SectorWorld& Carriers::world_of(const SectorIndex& sector) {
  std::unique_ptr<SectorWorld>& world = worlds_[sector];
  if (!world) world = engine_.make_world();
  return *world;
}

Carriers::Carriers(Engine& engine, double sector_size, const std::vector<const ShippedBody*>& bodies,
                   std::vector<const ShippedContact*> contacts,
                   const absl::flat_hash_map<BodyId, BodyRecord>& own, TaskBuilder& builder)
    : engine_(engine) {
  absl::flat_hash_map<BodyId, BodyRecord> records = own;
  for (const ShippedBody* shipped : bodies) {
    const ShippedBody& body = *shipped;
    const BodyId id = body.record.id;
    if (!records.try_emplace(id, body.record).second) continue;  // kinematic, and shipped by two servers
    if (body.record.properties.motion != Motion::kDynamic) continue;
    SectorWorld& world = world_of(body.record.home);
    const WorldBody place{&world, world.add(body.record, Role::kHome)};
    world.set_total_wrench(place.slot, body.wrench);
    homes_[id] = {body.record.home, place};
    builder.add_guest(id, place, body.record.home);
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

void take_solution(Partition& partition, const Solution& solution) {
  for (const SolvedBody& solved : solution.bodies) {
    const auto body = partition.bodies.find(solved.id);
    invariant(body != partition.bodies.end(), "a solution names bodies of the server that shipped them");
    body->second->sector->world->set_solved_state(body->second->slot, solved.state);
  }
  for (const ShippedContact& contact : solution.contacts) {
    SectorWorld& world = *partition.sectors.at(contact.sector)->world;
    const std::span<const ContactPair> pairs = world.contacts();
    const auto pair = std::lower_bound(
        pairs.begin(), pairs.end(), contact.manifold,
        [](const ContactPair& p, const ManifoldState& m) { return std::tie(p.a, p.b) < std::tie(m.a, m.b); });
    invariant(pair != pairs.end() && pair->a == contact.manifold.a && pair->b == contact.manifold.b,
              "a solution names contacts of the server that shipped them");
    world.set_manifold(static_cast<std::size_t>(pair - pairs.begin()), contact.manifold);
  }
}

}  // namespace tessera
