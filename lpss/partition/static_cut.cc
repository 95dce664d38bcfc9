#include "lpss/partition/static_cut.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace tessera {
namespace {

// The region as a box in the frame of a geometry that is posed by `pose`, widened to hold it under rotation.
Eigen::AlignedBox3d seen_from_geometry(const Eigen::AlignedBox3d& region, const Pose& pose) {
  const Pose back = pose.inverse();
  const Eigen::Vector3d centre = back * region.center();
  const Eigen::Vector3d half = back.orientation.toRotationMatrix().cwiseAbs() * (region.sizes() / 2);
  return {centre - half, centre + half};
}

struct Cutter {
  const Pose& pose;
  const Eigen::AlignedBox3d& region;
  const MeshTree* tree;

  // The half space again, with its origin at the foot of the region's centre.
  std::optional<ShapePart> operator()(const Plane& plane) const {
    const Eigen::Vector3d normal = pose.orientation * plane.normal;
    const double height = normal.dot(region.center() - pose.position);
    const double radius = region.sizes().norm() / 2;
    if (height > radius) return std::nullopt;
    return ShapePart{Plane{normal}, {region.center() - normal * height, Eigen::Quaterniond::Identity()}};
  }

  std::optional<ShapePart> operator()(const Box& box) const {
    const Eigen::AlignedBox3d whole(-box.size / 2, box.size / 2);
    Eigen::AlignedBox3d wanted = seen_from_geometry(region, pose);
    if (!whole.intersects(wanted)) return std::nullopt;
    // Faces that the cut makes stay well outside of the region, where nothing can touch them.
    const Eigen::Vector3d slack = wanted.sizes();
    wanted = Eigen::AlignedBox3d(wanted.min() - slack, wanted.max() + slack);
    const Eigen::AlignedBox3d part = whole.intersection(wanted);
    return ShapePart{Box{part.sizes()}, {pose * part.center(), pose.orientation}};
  }

  std::optional<ShapePart> operator()(const TriangleMesh& mesh) const {
    const Eigen::AlignedBox3d wanted = seen_from_geometry(region, pose);
    const Eigen::Vector3d origin = wanted.center();
    TriangleMesh part;
    absl::flat_hash_map<std::uint32_t, std::uint32_t> renumbered;
    for (const std::uint32_t triangle : tree->overlapping(wanted)) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::uint32_t vertex = mesh.indices[3 * std::size_t{triangle} + corner];
        const auto [place, is_new] =
            renumbered.try_emplace(vertex, static_cast<std::uint32_t>(part.vertices.size()));
        if (is_new) part.vertices.push_back(mesh.vertices[vertex] - origin);
        part.indices.push_back(place->second);
      }
    }
    if (part.indices.empty()) return std::nullopt;
    return ShapePart{std::move(part), {pose * origin, pose.orientation}};
  }

  std::optional<ShapePart> operator()(const HeightField& field) const {
    const Eigen::AlignedBox3d wanted = seen_from_geometry(region, pose);
    const Range columns = range(wanted.min().x(), wanted.max().x(), field.spacing.x(), field.columns);
    const Range rows = range(wanted.min().y(), wanted.max().y(), field.spacing.y(), field.rows);
    if (columns.count < 2 || rows.count < 2) return std::nullopt;
    HeightField part{columns.count, rows.count, field.spacing, {}};
    part.heights.reserve(std::size_t{columns.count} * rows.count);
    // Heights count from the middle of the region, so that a summit far above the origin keeps its precision.
    const double level = std::clamp(wanted.center().z(), -1e7, 1e7);
    for (std::uint32_t row = rows.first; row < rows.first + rows.count; ++row) {
      const double* line = &field.heights[std::size_t{row} * field.columns];
      for (std::uint32_t column = columns.first; column < columns.first + columns.count; ++column) {
        part.heights.push_back(line[column] - level);
      }
    }
    const Eigen::Vector3d origin(columns.centre(field.columns) * field.spacing.x(),
                                 rows.centre(field.rows) * field.spacing.y(), level);
    return ShapePart{std::move(part), {pose * origin, pose.orientation}};
  }

  template <typename Other>
  std::optional<ShapePart> operator()(const Other& other) const {
    return ShapePart{other, pose};
  }

 private:
  // Samples of one direction of a height field that surround [low, high].
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t count = 0;

    // Of the kept samples, in cells, from the centre of all `total`.
    double centre(std::uint32_t total) const { return first + (count - 1) / 2.0 - (total - 1) / 2.0; }
  };

  static Range range(double low, double high, double spacing, std::uint32_t total) {
    const double middle = (total - 1) / 2.0;
    const double first = std::floor(low / spacing + middle);
    const double last = std::ceil(high / spacing + middle);
    const double end = static_cast<double>(total) - 1;
    if (last < 0 || first > end) return {};
    Range kept;
    kept.first = static_cast<std::uint32_t>(std::clamp(first, 0.0, end));
    kept.count = static_cast<std::uint32_t>(std::clamp(last, 0.0, end)) - kept.first + 1;
    return kept;
  }
};

}  // namespace

std::optional<ShapePart> cut_to(const Geometry& geometry, const Pose& pose, const Eigen::AlignedBox3d& region,
                                const MeshTree* tree) {
  return std::visit(Cutter{pose, region, tree}, geometry);
}

std::optional<ShapePart> cut_ground_to(TileStore& store, const TileStore::Source& ground, const Pose& pose,
                                       const Eigen::AlignedBox3d& region) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  const Eigen::AlignedBox3d wanted = seen_from_geometry(region, pose);
  const Eigen::Vector3d origin = wanted.center();
  TriangleMesh part;
  std::vector<std::uint32_t> renumbered;  // of a tile's vertices
  for (const TileKey& key : ground.tiles->overlapping(wanted)) {
    const std::shared_ptr<const Tile> tile = store.get(ground, key);
    renumbered.assign(tile->vertices.size(), kNone);
    for (std::size_t n = 0; n < tile->triangles.size(); ++n) {
      Eigen::AlignedBox3d box;
      for (const std::uint32_t vertex : tile->triangles[n]) box.extend(tile->vertices[vertex]);
      if (!box.intersects(wanted)) continue;
      for (const std::uint32_t vertex : tile->triangles[n]) {
        if (renumbered[vertex] == kNone) {
          renumbered[vertex] = static_cast<std::uint32_t>(part.vertices.size());
          part.vertices.push_back(tile->vertices[vertex] - origin);
        }
        part.indices.push_back(renumbered[vertex]);
      }
      part.names.push_back(tile->name + static_cast<std::uint32_t>(n));
    }
  }
  if (part.indices.empty()) return std::nullopt;
  return ShapePart{std::move(part), {pose * origin, pose.orientation}};
}

void ask_for_ground(TileStore& store, const TileStore::SourceRef& ground, const Pose& pose,
                    const Eigen::AlignedBox3d& region) {
  const std::vector<TileKey> keys = ground->tiles->overlapping(seen_from_geometry(region, pose));
  if (!keys.empty()) store.ask(ground, keys);
}

bool may_have_ground(const TileStore::Source& ground, const Pose& pose, const Eigen::AlignedBox3d& region) {
  return !ground.tiles->overlapping(seen_from_geometry(region, pose)).empty();
}

}  // namespace tessera
