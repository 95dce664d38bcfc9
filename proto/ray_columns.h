// Many rays, and their first hits, with one array per field.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "query.pb.h"

namespace tessera {

struct RayRow {
  WorldPosition origin;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double length = 0;  // m
  BodyId except;      // passed through by this ray; 0: none
};

// Reads the rays of a query, which must outlive this.
class RayReader {
 public:
  // INVALID_ARGUMENT with the column that has neither one element for each ray nor one for all, or an index
  // beyond the sectors.
  static absl::StatusOr<RayReader> of(const v1::RaysQuery& rays);

  int size() const { return count_; }
  RayRow operator[](int ray) const;

 private:
  RayReader(const v1::RaysQuery& rays, int count) : rays_(&rays), count_(count) {}

  SectorIndex sector_of(int ray) const;

  const v1::RaysQuery* rays_;
  int count_;
};

// Appends to a query without rays.
class RayWriter {
 public:
  explicit RayWriter(v1::RaysQuery& rays) : rays_(rays) {}

  // Room for so many rays.
  void reserve(int rays);

  void add(const RayRow& ray);

 private:
  v1::RaysQuery& rays_;
  absl::flat_hash_map<SectorIndex, std::uint32_t> sectors_;
};

// What a ray hits first.
struct HitRow {
  BodyId body;          // 0: nothing, and the rest is 0
  double distance = 0;  // m
  WorldPosition position;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // on the body
};

// Appends to columns that are empty.
class HitWriter {
 public:
  explicit HitWriter(v1::HitColumns& columns) : columns_(columns) {}

  // Room for so many rays.
  void reserve(int rays);

  void add(const HitRow& hit);

 private:
  v1::HitColumns& columns_;
  absl::flat_hash_map<SectorIndex, std::uint32_t> sectors_;
};

// Appends a row for each ray. DATA_LOSS for columns of different lengths.
absl::Status append_rows(const v1::HitColumns& columns, std::vector<HitRow>& rows);

}  // namespace tessera
