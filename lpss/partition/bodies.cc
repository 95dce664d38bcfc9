#include "lpss/partition/bodies.h"

#include <algorithm>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/sectors.h"
#include "lpss/partition/statics.h"

namespace tessera {
namespace {

auto by_id = [](const HomeBody* body, BodyId id) { return body->id < id; };

bool is_pushed(const BodyProperties& properties) {
  return properties.motion == Motion::kDynamic && properties.lasting.has_value();
}

void insert_by_id(std::vector<HomeBody*>& bodies, HomeBody& body) {
  bodies.insert(std::lower_bound(bodies.begin(), bodies.end(), body.id, by_id), &body);
}

// Puts a body, whose properties are known, into its sector's engine world and on the lists that follow from
// these.
void place_home(Partition& partition, HomeBody& body, const BodyState& state) {
  Sector& sector = *body.sector;
  SectorWorld& world = world_of(partition, sector);
  body.slot = world.add({body.id, sector.index, body.properties, state}, Role::kHome);
  world.set_jointed(body.slot, body.jointed);
  world.set_gravity(body.slot,
                    partition.felt_in(sector.index)
                        .at(sector.index, Eigen::Vector3d(state.position.data()), body.properties.gravity));
  load_ballast(partition, body);
  if (body.properties.motion == Motion::kKinematic) insert_by_id(sector.kinematics, body);
  if (is_pushed(body.properties)) insert_by_id(sector.pushed, body);
  if (!body.programs.empty()) {
    insert_by_id(sector.programmed, body);
    ++partition.programmed_count;
  }
  const auto slot = static_cast<std::size_t>(body.slot);
  if (slot >= sector.by_slot.size()) sector.by_slot.resize(slot + 1, nullptr);
  sector.by_slot[slot] = &body;
  mark_dirty(body);
  sector.components_stale = true;
  activate(partition, sector);
}

void displace_home(Partition& partition, HomeBody& body) {
  Sector& sector = *body.sector;
  sector.world->remove(body.slot);
  std::erase(sector.kinematics, &body);
  std::erase(sector.pushed, &body);
  partition.programmed_count -= std::erase(sector.programmed, &body);
  sector.by_slot[static_cast<std::size_t>(body.slot)] = nullptr;
  sector.components_stale = true;
  activate(partition, sector);
}

}  // namespace

void add_shape(Partition& partition, ShapeId id, ShapeRef shape) {
  const auto [place, is_new] = partition.shapes.try_emplace(id, std::move(shape));
  invariant(is_new, "a shape id is given once");
  partition.engine.add_shape(id, *place->second);
}

void forget_shape(Partition& partition, ShapeId id) {
  if (partition.shapes.erase(id) > 0) partition.engine.forget_shape(id);
}

void add_module(Partition& partition, const std::shared_ptr<const ProgramModule>& module) {
  ProgramModules& modules = partition.settings.modules;
  if (std::ranges::find(modules, module) == modules.end()) modules.push_back(module);
}

double radius_of(const Partition& partition, const BodyProperties& properties) {
  const auto shape = partition.shapes.find(properties.shape);
  invariant(shape != partition.shapes.end(), "a body refers to a shape that was never added");
  return bounding_radius(*shape->second, Eigen::Vector3d(properties.centre.data()));
}

// The margins follow from the largest body that the world has ever had; all servers hear of all bodies.
void expect_radius(Partition& partition, double radius) {
  if (radius <= partition.radius_max) return;
  partition.radius_max = radius;
  partition.margins =
      seam_margins(partition.settings.sector_size, partition.settings.time_step, partition.radius_max);
}

void add_body(Partition& partition, const BodyRecord& record) {
  if (record.properties.motion != Motion::kStatic) {
    expect_radius(partition, radius_of(partition, record.properties));
  }
  if (record.properties.motion == Motion::kStatic) {
    add_static_body(partition, record);
  } else if (partition.hosts(record.home)) {
    add_home(partition, record);
  }
}

HomeBody& add_home(Partition& partition, const BodyRecord& record) {
  Sector& sector = sector_at(partition, record.home);
  auto body = std::make_unique<HomeBody>();
  body->id = record.id;
  body->properties = record.properties;
  body->programs = record.programs;
  body->radius = radius_of(partition, record.properties);
  body->jointed = !partition.joints.of(record.id).empty();
  body->sector = &sector;
  if (body->jointed) partition.jointed.insert(body->id);
  insert_by_id(sector.homes, *body);
  place_home(partition, *body, record.state);
  const auto [entry, is_new] = partition.bodies.try_emplace(record.id, std::move(body));
  invariant(is_new, "a body lives in one sector");
  return *entry->second;
}

void set_home_properties(Partition& partition, HomeBody& body, const BodyProperties& properties) {
  SectorWorld& world = *body.sector->world;
  wake_touching(partition, *body.sector, body.slot);
  world.wake(body.slot);
  BodyState state = world.state(body.slot);
  const Wrench wrench = world.total_wrench(body.slot);
  const double surge = world.surge(body.slot);
  if (properties.motion != body.properties.motion) {
    state.velocities_before.reset();
    body.kinematic_target.reset();
  }
  displace_home(partition, body);
  body.properties = properties;
  place_home(partition, body, state);
  if (properties.motion != Motion::kDynamic) return;
  world.set_total_wrench(body.slot, wrench);
  world.set_surge(body.slot, surge);
}

void set_lasting_force(HomeBody& body, const std::optional<LastingForce>& lasting) {
  Sector& sector = *body.sector;
  std::erase(sector.pushed, &body);
  body.properties.lasting = lasting;
  if (is_pushed(body.properties)) insert_by_id(sector.pushed, body);
}

BodyRecord remove_home(Partition& partition, HomeBody& body) {
  Sector& sector = *body.sector;
  BodyRecord record = record_of(body);
  displace_home(partition, body);
  sector.homes.erase(std::lower_bound(sector.homes.begin(), sector.homes.end(), body.id, by_id));
  if (body.attended) std::erase(sector.attended, &body);
  if (partition.jointed.erase(record.id) > 0) leave_joints(partition, record.id);
  partition.bodies.erase(record.id);
  partition.body_moves.note_left(record.id);
  return record;
}

BodyRecord record_of(const HomeBody& body) {
  return {body.id, body.sector->index, body.properties, body.sector->world->state(body.slot), body.programs};
}

std::optional<Ballast> ballast_of(const Partition& partition, BodyId body) {
  std::optional<Ballast> sum;
  for (const CarriedFrame& carried : partition.carried) {
    if (partition.settings.frames[carried.frame - 1].carrier->body != body) continue;
    if (!sum) sum.emplace();
    sum->mass += carried.ballast.mass;
    sum->inertia += carried.ballast.inertia;
  }
  return sum;
}

void load_ballast(const Partition& partition, HomeBody& body) {
  const std::optional<Ballast> ballast = ballast_of(partition, body.id);
  if (!ballast || body.properties.motion != Motion::kDynamic) return;
  std::array<double, 3> moments = body.properties.inertia;
  for (double& moment : moments) moment += ballast->inertia;
  body.sector->world->set_mass(body.slot, body.properties.mass + ballast->mass, moments);
}

void attend(HomeBody& body) {
  if (body.attended) return;
  body.attended = true;
  body.sector->attended.push_back(&body);
}

void mark_dirty(HomeBody& body) {
  body.dirty = true;
  attend(body);
}

void wake_home(Partition& partition, HomeBody& body) {
  if (body.properties.motion == Motion::kDynamic) body.sector->world->wake(body.slot);
  mark_dirty(body);
  activate(partition, *body.sector);
}

std::size_t body_count(const Partition& partition) {
  return partition.bodies.size() + partition.packed.counts().bodies;
}

Motion motion_of(const Partition& partition, BodyId id) {
  if (const auto body = partition.bodies.find(id); body != partition.bodies.end())
    return body->second->properties.motion;
  if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end())
    return replica->second->properties.motion;
  return Motion::kStatic;
}

// The home of a body from this tick on. A static body's is not looked at by anyone.
const SectorIndex& next_home(const Partition& partition, BodyId id) {
  static const SectorIndex kNowhere;
  if (const auto body = partition.bodies.find(id); body != partition.bodies.end()) {
    return body->second->next_home ? *body->second->next_home : body->second->sector->index;
  }
  if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end())
    return replica->second->next_home;
  return kNowhere;
}

bool lives_in(const Partition& partition, BodyId id, const Sector& sector) {
  const auto body = partition.bodies.find(id);
  return body != partition.bodies.end() && body->second->sector == &sector;
}

}  // namespace tessera
