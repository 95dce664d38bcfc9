#include "lpss/partition/statics.h"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/packing.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

// The surface of a static body, whose vectors are in its frame, along the world's axes.
Surface surface_in_world(const BodyRecord& record) {
  Surface surface = *record.properties.surface;
  const Eigen::Quaterniond turn =
      quaternion_of(record.state) * centre_frame(record.properties).orientation.conjugate();
  for (std::array<double, 3>* v : {&surface.direction, &surface.velocity, &surface.running}) {
    Eigen::Map<Eigen::Vector3d> mapped(v->data());
    mapped = (turn * mapped).eval();
  }
  return surface;
}

// What rests may be in a trigger that comes, or in whose trigger something comes to be.
void bring_back_noticing(Partition& partition, const BodyRecord& record, bool is_trigger) {
  const Eigen::AlignedBox3d region =
      cube(partition.sector_size() / 2 + partition.margins.reach + partition.radius_max);
  for (const SectorIndex& index :
       is_trigger ? partition.packed.sectors() : partition.packed.with_triggers()) {
    if (partition.statics.reaches(record.id, index, region)) bring_back(partition, index);
  }
}

// As much of a static body as the sector needs.
void add_static(const Partition& partition, Sector& sector, BodyId id) {
  BodyRecord record = *partition.statics.find(id);
  if (record.properties.surface) record.properties.surface = surface_in_world(record);
  StaticIndex::Cut cut = partition.statics.cut(id, sector.index, region_of_cuts(partition.sector_size()));
  if (cut.whole) {
    const Pose centre = cut.pose * centre_frame(record.properties);
    Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = centre.position;
    sector.statics[id] = sector.world->add(record, Role::kStatic);
    return;
  }
  if (cut.shape.parts.empty()) return;
  Pose pose;
  if (cut.shape.parts.size() == 1) std::swap(pose, cut.shape.parts.front().pose);
  sector.statics[id] = sector.world->add_static(id, record.properties, cut.shape, pose);
}

constexpr double kAheadTime = 2;      // s, that the ground is asked for ahead
constexpr int kAheadSectorsMax = 64;  // of a body, on its way

}  // namespace

Eigen::AlignedBox3d region_of_cuts(double sector_size) { return cube(1.5 * sector_size); }

void look_ahead_for_ground(const Partition& partition) {
  if (!partition.statics.has_ground()) return;
  const double half = partition.sector_size() / 2;
  absl::flat_hash_set<SectorIndex> asked;
  for (const Sector* sector : partition.active) {
    if (!sector->world) continue;
    for (const HomeBody* body : sector->homes) {
      if (sector->world->activity(body->slot) == Activity::kAsleep) continue;
      const Eigen::Vector3d from = sector->world->position(body->slot);
      const Eigen::Vector3d way = sector->world->linear_velocity(body->slot) * kAheadTime;
      // What is in the sector already has its ground.
      if (!way.allFinite() || (from + way).cwiseAbs().maxCoeff() < half) continue;
      const int steps = static_cast<int>(
          std::clamp(std::ceil(way.norm() / half), 1.0, static_cast<double>(kAheadSectorsMax)));
      for (int step = 1; step <= steps; ++step) {
        const absl::StatusOr<WorldPosition> there =
            canonical(sector->index, from + way * step / steps, partition.sector_size());
        if (!there.ok() || !asked.insert(there->sector).second) continue;
        const auto known = partition.sectors.find(there->sector);
        if (known != partition.sectors.end() && known->second->world) continue;
        partition.statics.ask_for_ground(there->sector, region_of_cuts(partition.sector_size()));
      }
    }
  }
}

Eigen::AlignedBox3d cube(double half_edge) {
  return {Eigen::Vector3d::Constant(-half_edge), Eigen::Vector3d::Constant(half_edge)};
}

// Makes sure that every static body that reaches into `box` is in the sector's world.
void add_statics(const Partition& partition, Sector& sector, const Eigen::AlignedBox3d& box) {
  if (sector.static_region.contains(box)) return;
  sector.static_region.extend(box);
  for (const BodyId id : partition.statics.overlapping(sector.index, sector.static_region)) {
    if (!sector.statics.contains(id)) add_static(partition, sector, id);
  }
}

void add_static_body(Partition& partition, const BodyRecord& record) {
  const auto shape = partition.shapes.find(record.properties.shape);
  invariant(shape != partition.shapes.end(), "a static body refers to a shape that was never added");
  partition.statics.add(record, *shape->second);
  const bool is_trigger = record.properties.trigger || has_triggers(*shape->second);
  bring_back_noticing(partition, record, is_trigger);
  for (auto& [index, sector] : partition.sectors) {
    if (!sector->world || !partition.statics.reaches(record.id, index, sector->static_region)) continue;
    if (!sector->statics.contains(record.id)) add_static(partition, *sector, record.id);
    if (!is_trigger && !sector->world->has_triggers()) continue;
    sector->overlaps_stale = true;
    activate(partition, *sector);
  }
}

void remove_static_body(Partition& partition, BodyId id) {
  if (partition.statics.find(id) == nullptr) return;
  bring_back_touching(partition, id);
  partition.statics.remove(id);
  for (auto& [index, sector] : partition.sectors) {
    const auto place = sector->statics.find(id);
    if (place == sector->statics.end()) continue;
    wake_touching(partition, *sector, place->second);
    sector->world->remove(place->second);
    sector->statics.erase(place);
    sector->components_stale = true;
    activate(partition, *sector);
  }
}

void set_static_surface_motion(Partition& partition, BodyId id, const std::array<double, 3>& velocity,
                               const std::array<double, 3>& running) {
  BodyProperties properties = partition.statics.find(id)->properties;
  set_surface_motion(properties, velocity, running);
  partition.statics.set_surface(id, *properties.surface);
  const Surface surface = surface_in_world(*partition.statics.find(id));
  bring_back_touching(partition, id);
  for (auto& [index, sector] : partition.sectors) {
    const auto place = sector->statics.find(id);
    if (place == sector->statics.end()) continue;
    sector->world->set_surface(place->second, surface);
    wake_touching(partition, *sector, place->second);
    activate(partition, *sector);
  }
}

}  // namespace tessera
