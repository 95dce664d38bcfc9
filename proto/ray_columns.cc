#include "proto/ray_columns.h"

#include <algorithm>

#include "lpss/model/checks.h"
#include "proto/convert.h"

namespace tessera {
namespace {

void append(const Eigen::Vector3d& vector, google::protobuf::RepeatedField<double>& column) {
  column.Add(vector.data(), vector.data() + vector.size());
}

// The element for a ray, of a column that has one for each or one for all.
template <typename Column>
const auto& element(const Column& column, int ray, int width = 1) {
  return column.Get(column.size() == width ? 0 : width * ray);
}

// The place of a sector in a table, to which it is added if it is new.
std::uint32_t place_of(const SectorIndex& sector, absl::flat_hash_map<SectorIndex, std::uint32_t>& places,
                       google::protobuf::RepeatedPtrField<v1::SectorIndex>& table) {
  const auto [place, is_new] = places.try_emplace(sector, table.size());
  if (is_new) *table.Add() = to_proto(sector);
  return place->second;
}

struct RayColumn {
  const char* name;
  int numbers;
  int width;  // numbers of a ray
  bool may_be_absent = false;
};

absl::StatusOr<int> count_of(const v1::RaysQuery& rays) {
  const RayColumn columns[] = {{"sector", rays.sector_size(), 1, true},
                               {"origins", rays.origins_size(), 3},
                               {"directions", rays.directions_size(), 3},
                               {"lengths", rays.lengths_size(), 1},
                               {"except_by_ray", rays.except_by_ray_size(), 1, true}};
  int count = 0;
  for (const RayColumn& column : columns) {
    if (column.numbers % column.width != 0)
      return refused(column.name, ": ", column.numbers, " numbers must be ", column.width, " for each ray");
    count = std::max(count, column.numbers / column.width);
  }
  for (const RayColumn& column : columns) {
    const int elements = column.numbers / column.width;
    if (elements == count || elements == 1 || (elements == 0 && column.may_be_absent)) continue;
    return refused(column.name, ": ", elements, " elements must be one for each of ", count,
                   " rays, or one for all");
  }
  return count;
}

bool agree(const v1::HitColumns& columns) {
  const int count = columns.bodies_size();
  if (columns.distances_size() != count || columns.sector_size() != count ||
      columns.positions_size() != 3 * count || columns.normals_size() != 3 * count)
    return false;
  for (int ray = 0; ray < count; ++ray) {
    if (columns.bodies(ray) != 0 && columns.sector(ray) >= static_cast<std::uint32_t>(columns.sectors_size()))
      return false;
  }
  return true;
}

}  // namespace

absl::StatusOr<RayReader> RayReader::of(const v1::RaysQuery& rays) {
  const absl::StatusOr<int> count = count_of(rays);
  if (!count.ok()) return count.status();
  for (int n = 0; n < rays.sector_size(); ++n) {
    if (rays.sector(n) < static_cast<std::uint32_t>(rays.sectors_size())) continue;
    return refused("sector[", n, "] = ", rays.sector(n), " must be below ", rays.sectors_size(),
                   ", the number of sectors");
  }
  return RayReader(rays, *count);
}

SectorIndex RayReader::sector_of(int ray) const {
  if (rays_->sectors().empty()) return {};
  const std::uint32_t place = rays_->sector().empty() ? 0 : element(rays_->sector(), ray);
  return from_proto(rays_->sectors(static_cast<int>(place)));
}

RayRow RayReader::operator[](int ray) const {
  return {{sector_of(ray), Eigen::Vector3d(&element(rays_->origins(), ray, 3))},
          Eigen::Vector3d(&element(rays_->directions(), ray, 3)),
          element(rays_->lengths(), ray),
          BodyId{rays_->except_by_ray().empty() ? 0 : element(rays_->except_by_ray(), ray)}};
}

void RayWriter::reserve(int rays) {
  rays_.mutable_sector()->Reserve(rays);
  rays_.mutable_origins()->Reserve(3 * rays);
  rays_.mutable_directions()->Reserve(3 * rays);
  rays_.mutable_lengths()->Reserve(rays);
  rays_.mutable_except_by_ray()->Reserve(rays);
}

void RayWriter::add(const RayRow& ray) {
  rays_.add_sector(place_of(ray.origin.sector, sectors_, *rays_.mutable_sectors()));
  append(ray.origin.local, *rays_.mutable_origins());
  append(ray.direction, *rays_.mutable_directions());
  rays_.add_lengths(ray.length);
  rays_.add_except_by_ray(ray.except.value);
}

void HitWriter::reserve(int rays) {
  columns_.mutable_bodies()->Reserve(rays);
  columns_.mutable_distances()->Reserve(rays);
  columns_.mutable_sector()->Reserve(rays);
  columns_.mutable_positions()->Reserve(3 * rays);
  columns_.mutable_normals()->Reserve(3 * rays);
}

void HitWriter::add(const HitRow& hit) {
  const bool is_hit = hit.body.value != 0;
  columns_.add_bodies(hit.body.value);
  columns_.add_distances(hit.distance);
  columns_.add_sector(is_hit ? place_of(hit.position.sector, sectors_, *columns_.mutable_sectors()) : 0);
  append(hit.position.local, *columns_.mutable_positions());
  append(hit.normal, *columns_.mutable_normals());
}

absl::Status append_rows(const v1::HitColumns& columns, std::vector<HitRow>& rows) {
  if (!agree(columns)) return absl::DataLossError("hits of rays in columns of different lengths");
  rows.reserve(rows.size() + static_cast<std::size_t>(columns.bodies_size()));
  for (int ray = 0; ray < columns.bodies_size(); ++ray) {
    HitRow& row = rows.emplace_back();
    row.body = BodyId{columns.bodies(ray)};
    if (row.body.value == 0) continue;
    row.distance = columns.distances(ray);
    row.position = {from_proto(columns.sectors(static_cast<int>(columns.sector(ray)))),
                    Eigen::Vector3d(&columns.positions().Get(3 * ray))};
    row.normal = Eigen::Vector3d(&columns.normals().Get(3 * ray));
  }
  return absl::OkStatus();
}

}  // namespace tessera
