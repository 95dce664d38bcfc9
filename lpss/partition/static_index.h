// All static bodies of a world, and which of them a sector needs.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/ground/tile_store.h"
#include "lpss/model/body.h"
#include "lpss/model/shape.h"
#include "lpss/partition/mesh_tree.h"

namespace tessera {

// The static bodies, found by place. Every server knows all of them; what is copied into a sector is only
// what reaches into it, and of a large one only the part that does.
class StaticIndex {
 public:
  // `tiles` are those of grounds.
  explicit StaticIndex(double sector_size, TileStore& tiles = TileStore::of_process())
      : sector_size_(sector_size), tiles_(tiles) {}

  // `shape` is the body's shape; it must outlive the index. Its grounds can be opened.
  void add(const BodyRecord& record, const Shape& shape);
  bool remove(BodyId id);

  // nullptr if there is no such static body.
  const BodyRecord* find(BodyId id) const;

  // There is such a body.
  void set_surface(BodyId id, const Surface& surface) { bodies_.at(id).record.properties.surface = surface; }

  // Whether a static body of the index may reach into `box` (m, relative to the centre of `sector`).
  bool reaches(BodyId id, const SectorIndex& sector, const Eigen::AlignedBox3d& box) const;

  // The ids, ascending, of those that do.
  std::vector<BodyId> overlapping(const SectorIndex& sector, const Eigen::AlignedBox3d& box) const;

  // Whether the body, which there is, may reach into the cube of `sector`: a large one may anywhere.
  bool is_in(BodyId id, const SectorIndex& sector) const;

  // Of a line from `origin` along `direction` (of unit length), from where to where (m) it may be within
  // `reach` (m) of a body that by_sector() does not list, because it is large: a rough bound. Nothing if it
  // is not.
  std::optional<std::pair<double, double>> near_large(const WorldPosition& origin,
                                                      const Eigen::Vector3d& direction, double length,
                                                      double reach) const;

  // Sectors with the ids of bodies that may reach into them, ascending; without large bodies.
  const absl::flat_hash_map<SectorIndex, std::vector<BodyId>>& by_sector() const { return by_sector_; }

  // As much of a static body as matters within `region` (m, relative to the centre of `sector`), posed in
  // the sector's frame.
  struct Cut {
    bool whole = false;  // the shared shape of the body will do; `shape` is not set
    Shape shape;
    Pose pose;  // of the body frame, or of what `shape` is given in
  };
  Cut cut(BodyId id, const SectorIndex& sector, const Eigen::AlignedBox3d& region) const;

  // Has the tiles of grounds made that cut() will need. Cheap where there is no ground.
  bool has_ground() const { return !grounds_.empty(); }
  void ask_for_ground(const SectorIndex& sector, const Eigen::AlignedBox3d& region) const;

  // Whether that cut of a ground may have any triangle. Needs no tile.
  bool may_have_ground(const SectorIndex& sector, const Eigen::AlignedBox3d& region) const;

  std::size_t size() const { return bodies_.size(); }
  // Another one after each body that comes or goes.
  std::uint64_t revision() const { return revision_; }

  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [id, entry] : bodies_) visit(entry.record);
  }

 private:
  // By the parts of a shape: null for those that are not meshes.
  using MeshTrees = std::vector<std::unique_ptr<const MeshTree>>;
  struct Entry {
    BodyRecord record;
    const Shape* shape;
    Pose pose;      // of the body frame, relative to the home's centre
    double radius;  // around the home-relative position; infinite for planes
    bool large;
    std::shared_ptr<const MeshTrees> trees;  // of a large one
    std::vector<TileStore::SourceRef>
        grounds;  // by the parts of the shape; null for those that are not ground
  };

  // Sectors that the entry's box overlaps; only for entries that are not large.
  std::vector<SectorIndex> cells(const Entry& entry) const;

  // Bodies of one shape share them.
  std::shared_ptr<const MeshTrees> trees_of(const Shape& shape) const;

  // The frame of the shape, relative to the sector.
  Pose pose_in(const SectorIndex& sector, const Entry& entry) const;

  // Calls visit(ground, pose) for all grounds, with their poses relative to the sector.
  template <typename Visit>
  void for_each_ground(const SectorIndex& sector, const Visit& visit) const;

  double sector_size_;
  std::uint64_t revision_ = 0;
  TileStore& tiles_;
  absl::btree_map<BodyId, Entry> bodies_;
  absl::flat_hash_map<SectorIndex, std::vector<BodyId>> by_sector_;
  std::vector<BodyId> large_;    // ascending; those that reach over many sectors, or have no end
  std::vector<BodyId> grounds_;  // ascending; of those, the ones with ground
};

}  // namespace tessera
