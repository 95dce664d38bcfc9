// States of many bodies, with one array per field.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <Eigen/Core>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "query.pb.h"

namespace tessera {

struct BodyRow {
  BodyId id;
  WorldPose pose;                                              // of the body frame
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   // of the centre of mass, m/s
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s
  bool asleep = false;
};

// Appends to columns that are empty.
class ColumnWriter {
 public:
  explicit ColumnWriter(v1::BodyColumns& columns) : columns_(columns) {}

  // Room for so many rows.
  void reserve(int rows);

  void add(const BodyRow& row);

 private:
  v1::BodyColumns& columns_;
  absl::flat_hash_map<SectorIndex, std::uint32_t> sectors_;
};

// Appends all of them. DATA_LOSS for columns of different lengths.
absl::Status append_rows(const v1::BodyColumns& columns, std::vector<BodyRow>& rows);

}  // namespace tessera
