#include "lpss/partition/statics.h"

#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

// As much of a static body as the sector needs.
void add_static(const Partition& partition, Sector& sector, BodyId id) {
  const BodyRecord& record = *partition.statics.find(id);
  StaticIndex::Part part = partition.statics.part(id, sector.index, cube(1.5 * partition.sector_size()));
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

}  // namespace

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
  for (auto& [index, sector] : partition.sectors) {
    if (sector->world && partition.statics.reaches(record.id, index, sector->static_region)) {
      add_static(partition, *sector, record.id);
    }
  }
}

void remove_static_body(Partition& partition, BodyId id) {
  if (!partition.statics.remove(id)) return;
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

}  // namespace tessera
