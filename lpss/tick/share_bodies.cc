// Sectors and what is in them: created when a body enters, gone when the last one leaves.
#include <absl/container/flat_hash_set.h>

#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/model/gravity.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

Eigen::AlignedBox3d cube(double half_edge) {
  return {Eigen::Vector3d::Constant(-half_edge), Eigen::Vector3d::Constant(half_edge)};
}

auto by_id = [](const HomeBody* body, BodyId id) { return body->id < id; };

}  // namespace

void Share::add_shape(ShapeId id, const Shape& shape) {
  const auto [place, is_new] = shapes_.try_emplace(id, std::make_unique<Shape>(shape));
  invariant(is_new, "a shape id is given once");
  engine_.add_shape(id, *place->second);
}

double Share::radius_of(const BodyProperties& properties) const {
  const auto shape = shapes_.find(properties.shape);
  invariant(shape != shapes_.end(), "a body refers to a shape that was never added");
  return bounding_radius(*shape->second, Eigen::Vector3d(properties.centre.data()));
}

// The margins follow from the largest body that the world has ever had; all shares hear of all bodies.
void Share::expect_radius(double radius) {
  if (radius <= radius_max_) return;
  radius_max_ = radius;
  margins_ = seam_margins(options_.settings.sector_size, options_.settings.time_step, radius_max_);
  margins_changed_ = true;
}

void Share::know_radius(const BodyProperties& properties) {
  if (properties.motion != Motion::kStatic) expect_radius(radius_of(properties));
}

void Share::add_body(const BodyRecord& record) {
  know_radius(record.properties);
  if (record.properties.motion == Motion::kStatic) {
    spawn_static(record);
  } else if (mine(record.home)) {
    add_home(record);
  }
}

Sector& Share::sector_at(const SectorIndex& index) {
  std::unique_ptr<Sector>& sector = sectors_[index];
  if (!sector) {
    sector = std::make_unique<Sector>();
    sector->index = index;
  }
  return *sector;
}

SectorWorld& Share::world_of(Sector& sector) {
  if (!sector.world) {
    sector.world = engine_.make_world();
    ++worlds_;
    add_statics(sector, cube(size() / 2 + margins_.reach + radius_max_));
  }
  return *sector.world;
}

// Makes sure that every static body that reaches into `box` is in the sector's world.
void Share::add_statics(Sector& sector, const Eigen::AlignedBox3d& box) {
  if (sector.static_region.contains(box)) return;
  sector.static_region.extend(box);
  for (const BodyId id : statics_.overlapping(sector.index, sector.static_region)) {
    if (!sector.statics.contains(id)) add_static(sector, id);
  }
}

// As much of a static body as the sector needs.
void Share::add_static(Sector& sector, BodyId id) {
  const BodyRecord& record = *statics_.find(id);
  StaticIndex::Part part = statics_.part(id, sector.index, cube(1.5 * size()));
  if (part.whole) {
    BodyRecord moved = record;
    const Pose centre = part.pose * centre_frame(record.properties);
    Eigen::Map<Eigen::Vector3d>(moved.state.position.data()) = centre.position;
    sector.statics[id] = sector.world->add(moved, Role::kStatic);
    return;
  }
  if (part.shape.parts.empty()) return;
  Pose pose;
  if (part.shape.parts.size() == 1) std::swap(pose, part.shape.parts.front().pose);
  sector.statics[id] = sector.world->add_static(id, record.properties, part.shape, pose);
}

HomeBody& Share::add_home(const BodyRecord& record) {
  Sector& sector = sector_at(record.home);
  SectorWorld& world = world_of(sector);
  auto body = std::make_unique<HomeBody>();
  body->id = record.id;
  body->properties = record.properties;
  body->radius = radius_of(record.properties);
  body->jointed = !joints_.of(record.id).empty();
  body->sector = &sector;
  body->slot = world.add(record, Role::kHome);
  world.set_jointed(body->slot, body->jointed);
  if (record.properties.gravity) {
    world.set_gravity(body->slot, acceleration_at(options_.settings.gravity, record.home,
                                                  Eigen::Vector3d(record.state.position.data()), size()));
  }
  const auto place = std::lower_bound(sector.homes.begin(), sector.homes.end(), record.id, by_id);
  sector.homes.insert(place, body.get());
  sector.regroup = true;
  activate(sector);
  const auto [entry, is_new] = bodies_.try_emplace(record.id, std::move(body));
  invariant(is_new, "a body lives in one sector");
  return *entry->second;
}

BodyRecord Share::remove_home(HomeBody& body) {
  Sector& sector = *body.sector;
  const BodyRecord record = record_of(body);
  sector.world->remove(body.slot);
  sector.homes.erase(std::lower_bound(sector.homes.begin(), sector.homes.end(), body.id, by_id));
  sector.regroup = true;
  activate(sector);
  bodies_.erase(record.id);
  return record;
}

BodyRecord Share::record_of(const HomeBody& body) const {
  return {body.id, body.sector->index, body.properties, body.sector->world->state(body.slot)};
}

// An engine world lives only while a body that can move does.
void Share::drop_if_empty(Sector& sector) {
  if (!sector.homes.empty()) return;
  if (sector.world) {
    if (sector.parts_known) vacated_.push_back(sector.index);
    sector.parts_known = false;
    sector.components.clear();
    sector.component_bodies.clear();
    sector.component_clones.clear();
    sector.component_pairs.clear();
    sector.parts.clear();
    sector.part_components.clear();
    for (const auto& [a, b] : sector.touching) ended_.push_back({a, b});
    sector.touching.clear();
    sector.statics.clear();
    sector.static_region.setEmpty();
    for (auto& [id, clone] : sector.clones) clone.slot = Clone::kNotPlaced;
    clones_ -= sector.counted;
    sector.placed = 0;
    sector.counted = 0;
    sector.world.reset();
    --worlds_;
  }
  sector.awake = false;
  sector.regroup = false;
  if (!sector.clones.empty()) return;
  if (sector.active) std::erase(active_, &sector);
  sectors_.erase(SectorIndex(sector.index));
}

void Share::activate(Sector& sector) {
  if (sector.active) return;
  sector.active = true;
  active_.push_back(&sector);
}

// Bodies that rest on something that goes away must notice.
void Share::wake_touching(Sector& sector, BodySlot slot) {
  for (const ContactPair& pair : sector.world->contacts()) {
    if (pair.slot_a != slot && pair.slot_b != slot) continue;
    const BodyId partner = pair.slot_a == slot ? pair.b : pair.a;
    const auto body = bodies_.find(partner);
    if (body != bodies_.end() && body->second->sector == &sector) {
      sector.world->wake(body->second->slot);
      activate(sector);
    }
  }
}

void Share::spawn_static(const BodyRecord& record) {
  const auto shape = shapes_.find(record.properties.shape);
  invariant(shape != shapes_.end(), "a static body refers to a shape that was never added");
  statics_.add(record, *shape->second);
  for (auto& [index, sector] : sectors_) {
    if (sector->world && statics_.reaches(record.id, index, sector->static_region)) {
      add_static(*sector, record.id);
    }
  }
}

void Share::remove_static(BodyId id) {
  if (!statics_.remove(id)) return;
  for (auto& [index, sector] : sectors_) {
    const auto place = sector->statics.find(id);
    if (place == sector->statics.end()) continue;
    wake_touching(*sector, place->second);
    sector->world->remove(place->second);
    sector->statics.erase(place);
    sector->regroup = true;
    activate(*sector);
  }
}

}  // namespace tessera
