#include "lpss/partition/static_index.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "lpss/base/invariant.h"
#include "lpss/partition/static_cut.h"

namespace tessera {
namespace {

// Static bodies that reach over more sectors than this in one direction are kept in a list of their own.
constexpr double kCellsMax = 4;

Pose body_frame(const BodyRecord& record) {
  const Pose centre{Eigen::Vector3d(record.state.position.data()), quaternion_of(record.state)};
  return centre * centre_frame(record.properties).inverse();
}

void insert_sorted(std::vector<BodyId>& ids, BodyId id) {
  ids.insert(std::upper_bound(ids.begin(), ids.end(), id), id);
}

void erase_sorted(std::vector<BodyId>& ids, BodyId id) {
  const auto place = std::lower_bound(ids.begin(), ids.end(), id);
  if (place != ids.end() && *place == id) ids.erase(place);
}

}  // namespace

std::vector<SectorIndex> StaticIndex::cells(const Entry& entry) const {
  std::vector<SectorIndex> result;
  const auto low = [&](int axis) {
    return static_cast<std::int64_t>(
        std::floor((entry.pose.position[axis] - entry.radius) / sector_size_ + 0.5));
  };
  const auto high = [&](int axis) {
    return static_cast<std::int64_t>(
        std::floor((entry.pose.position[axis] + entry.radius) / sector_size_ + 0.5));
  };
  for (std::int64_t i = low(0); i <= high(0); ++i) {
    for (std::int64_t j = low(1); j <= high(1); ++j) {
      for (std::int64_t k = low(2); k <= high(2); ++k) {
        const absl::StatusOr<SectorIndex> cell = translated(entry.record.home, {i, j, k});
        if (cell.ok()) result.push_back(*cell);
      }
    }
  }
  return result;
}

void StaticIndex::add(const BodyRecord& record, const Shape& shape) {
  ++revision_;
  Entry entry{record, &shape, body_frame(record), 0, false, nullptr, {}};
  entry.radius = is_bounded(shape) ? bounding_radius(shape, Eigen::Vector3d::Zero())
                                   : std::numeric_limits<double>::infinity();
  entry.large = !(2 * entry.radius <= kCellsMax * sector_size_);
  for (const ShapePart& part : shape.parts) {
    const auto* ground = std::get_if<Ground>(&part.geometry);
    if (ground == nullptr) continue;
    entry.large = true;
    absl::StatusOr<TileStore::SourceRef> source = tiles_.open(*ground);
    invariant(source.ok(), "a ground is opened before a body has it");
    entry.grounds.resize(shape.parts.size());
    entry.grounds[static_cast<std::size_t>(&part - shape.parts.data())] = *std::move(source);
  }
  if (entry.large) entry.trees = trees_of(shape);
  const auto [place, is_new] = bodies_.try_emplace(record.id, entry);
  if (!is_new) return;
  if (entry.large) {
    insert_sorted(large_, record.id);
    if (!entry.grounds.empty()) insert_sorted(grounds_, record.id);
    return;
  }
  for (const SectorIndex& cell : cells(entry)) insert_sorted(by_sector_[cell], record.id);
}

std::shared_ptr<const StaticIndex::MeshTrees> StaticIndex::trees_of(const Shape& shape) const {
  for (const BodyId id : large_) {
    const Entry& other = bodies_.at(id);
    if (other.shape == &shape) return other.trees;
  }
  auto trees = std::make_shared<MeshTrees>();
  for (const ShapePart& part : shape.parts) {
    const auto* mesh = std::get_if<TriangleMesh>(&part.geometry);
    trees->push_back(mesh == nullptr ? nullptr : std::make_unique<const MeshTree>(*mesh));
  }
  return trees;
}

bool StaticIndex::remove(BodyId id) {
  const auto place = bodies_.find(id);
  if (place == bodies_.end()) return false;
  ++revision_;
  if (place->second.large) {
    erase_sorted(large_, id);
    erase_sorted(grounds_, id);
  } else {
    for (const SectorIndex& cell : cells(place->second)) {
      const auto listed = by_sector_.find(cell);
      if (listed == by_sector_.end()) continue;
      erase_sorted(listed->second, id);
      if (listed->second.empty()) by_sector_.erase(listed);
    }
  }
  bodies_.erase(place);
  return true;
}

const BodyRecord* StaticIndex::find(BodyId id) const {
  const auto place = bodies_.find(id);
  return place == bodies_.end() ? nullptr : &place->second.record;
}

bool StaticIndex::reaches(BodyId id, const SectorIndex& sector, const Eigen::AlignedBox3d& box) const {
  const Entry& entry = bodies_.at(id);
  if (entry.record.home.frame != sector.frame) return false;
  const Eigen::Vector3d centre =
      metres_between(sector, entry.record.home, sector_size_) + entry.pose.position;
  return box.squaredExteriorDistance(centre) <= entry.radius * entry.radius;
}

bool StaticIndex::is_in(BodyId id, const SectorIndex& sector) const {
  const Entry& entry = bodies_.at(id);
  if (entry.large) return entry.record.home.frame == sector.frame;
  const auto listed = by_sector_.find(sector);
  return listed != by_sector_.end() && std::ranges::binary_search(listed->second, id);
}

std::vector<BodyId> StaticIndex::overlapping(const SectorIndex& sector,
                                             const Eigen::AlignedBox3d& box) const {
  std::vector<BodyId> found;
  const auto consider = [&](BodyId id) {
    if (reaches(id, sector, box)) found.push_back(id);
  };
  const auto cell_of = [&](double x) {
    return static_cast<std::int64_t>(std::floor(x / sector_size_ + 0.5));
  };
  const Eigen::Array3d cells = (box.max() - box.min()).array() / sector_size_ + 2;
  if (cells.prod() > static_cast<double>(by_sector_.size())) {
    // What is very fast reaches across more sectors than there are with anything in them.
    for (const auto& [cell, ids] : by_sector_) {
      for (const BodyId id : ids) consider(id);
    }
  } else {
    for (std::int64_t i = cell_of(box.min().x()); i <= cell_of(box.max().x()); ++i) {
      for (std::int64_t j = cell_of(box.min().y()); j <= cell_of(box.max().y()); ++j) {
        for (std::int64_t k = cell_of(box.min().z()); k <= cell_of(box.max().z()); ++k) {
          const absl::StatusOr<SectorIndex> cell = translated(sector, {i, j, k});
          if (!cell.ok()) continue;
          const auto listed = by_sector_.find(*cell);
          if (listed == by_sector_.end()) continue;
          for (const BodyId id : listed->second) consider(id);
        }
      }
    }
  }
  for (const BodyId id : large_) consider(id);
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

std::optional<std::pair<double, double>> StaticIndex::near_large(const WorldPosition& origin,
                                                                 const Eigen::Vector3d& direction,
                                                                 double length, double reach) const {
  std::optional<std::pair<double, double>> near;
  const auto add = [&](double from, double to) {
    from = std::max(from, 0.0);
    to = std::min(to, length);
    if (from > to) return;
    near = near ? std::pair(std::min(near->first, from), std::max(near->second, to)) : std::pair(from, to);
  };
  for (const BodyId id : large_) {
    const Entry& entry = bodies_.at(id);
    if (entry.record.home.frame != origin.sector.frame) continue;
    const Pose pose = pose_in(origin.sector, entry);
    if (std::isfinite(entry.radius)) {
      const Eigen::Vector3d centre = pose.position - origin.local;
      const double middle = centre.dot(direction);
      const double half = entry.radius + reach;
      if ((centre - middle * direction).norm() <= half) add(middle - half, middle + half);
      continue;
    }
    for (const ShapePart& part : entry.shape->parts) {
      const auto* plane = std::get_if<Plane>(&part.geometry);
      if (plane == nullptr) return std::pair(0.0, length);
      const Pose posed = pose * part.pose;
      const Eigen::Vector3d normal = posed.orientation * plane->normal;
      const double above = normal.dot(origin.local - posed.position) - reach;
      const double climb = normal.dot(direction);
      const double crosses = above == 0 ? 0 : -above / climb;  // there it is as far from the plane as `reach`
      if (above <= 0) add(0, climb > 0 ? crosses : length);
      if (above > 0 && climb < 0) add(crosses, length);
    }
  }
  return near;
}

Pose StaticIndex::pose_in(const SectorIndex& sector, const Entry& entry) const {
  return {metres_between(sector, entry.record.home, sector_size_) + entry.pose.position,
          entry.pose.orientation};
}

template <typename Visit>
void StaticIndex::for_each_ground(const SectorIndex& sector, const Visit& visit) const {
  for (const BodyId id : grounds_) {
    const Entry& entry = bodies_.at(id);
    if (entry.record.home.frame != sector.frame) continue;
    const Pose pose = pose_in(sector, entry);
    for (std::size_t n = 0; n < entry.grounds.size(); ++n) {
      if (entry.grounds[n]) visit(entry.grounds[n], pose * entry.shape->parts[n].pose);
    }
  }
}

void StaticIndex::ask_for_ground(const SectorIndex& sector, const Eigen::AlignedBox3d& region) const {
  for_each_ground(sector, [&](const TileStore::SourceRef& ground, const Pose& pose) {
    tessera::ask_for_ground(tiles_, ground, pose, region);
  });
}

bool StaticIndex::may_have_ground(const SectorIndex& sector, const Eigen::AlignedBox3d& region) const {
  bool may = false;
  for_each_ground(sector, [&](const TileStore::SourceRef& ground, const Pose& pose) {
    may = may || tessera::may_have_ground(*ground, pose, region);
  });
  return may;
}

StaticIndex::Cut StaticIndex::cut(BodyId id, const SectorIndex& sector,
                                  const Eigen::AlignedBox3d& region) const {
  const auto place = bodies_.find(id);
  invariant(place != bodies_.end(), "a sector asked for a static body that is not in the index");
  const Entry& entry = place->second;
  Cut result;
  const Pose pose = pose_in(sector, entry);
  if (!entry.large) {
    result.whole = true;
    result.pose = pose;
    return result;
  }
  for (std::size_t n = 0; n < entry.shape->parts.size(); ++n) {
    const ShapePart& piece = entry.shape->parts[n];
    const Pose posed = pose * piece.pose;
    const bool is_ground = !entry.grounds.empty() && entry.grounds[n];
    std::optional<ShapePart> kept = is_ground
                                        ? cut_ground_to(tiles_, *entry.grounds[n], posed, region)
                                        : cut_to(piece.geometry, posed, region, (*entry.trees)[n].get());
    if (!kept) continue;
    if (piece.material) {
      // Its direction is in the frame of the piece, which the cut may have changed.
      kept->material = piece.material;
      Eigen::Map<Eigen::Vector3d> direction(kept->material->surface.direction.data());
      direction = (kept->pose.orientation.conjugate() * posed.orientation * direction).eval();
    }
    result.shape.parts.push_back(std::move(*kept));
  }
  return result;
}

}  // namespace tessera
