#include "proto/body_columns.h"

#include <algorithm>

#include "proto/convert.h"

namespace tessera {
namespace {

template <typename Vector>
void put(const Vector& vector, google::protobuf::RepeatedField<double>& column) {
  column.Add(vector.data(), vector.data() + vector.size());
}

bool agree(const v1::BodyColumns& columns) {
  const int count = columns.ids_size();
  return columns.sector_size() == count && columns.positions_size() == 3 * count &&
         columns.orientations_size() == 4 * count && columns.linear_velocities_size() == 3 * count &&
         columns.angular_velocities_size() == 3 * count && columns.asleep_size() == count &&
         std::all_of(columns.sector().begin(), columns.sector().end(), [&](std::uint32_t place) {
           return place < static_cast<std::uint32_t>(columns.sectors_size());
         });
}

}  // namespace

void ColumnWriter::reserve(int rows) {
  columns_.mutable_ids()->Reserve(rows);
  columns_.mutable_sector()->Reserve(rows);
  columns_.mutable_positions()->Reserve(3 * rows);
  columns_.mutable_orientations()->Reserve(4 * rows);
  columns_.mutable_linear_velocities()->Reserve(3 * rows);
  columns_.mutable_angular_velocities()->Reserve(3 * rows);
  columns_.mutable_asleep()->Reserve(rows);
}

void ColumnWriter::add(const BodyRow& row) {
  const auto [place, is_new] = sectors_.try_emplace(row.pose.position.sector, columns_.sectors_size());
  if (is_new) *columns_.add_sectors() = to_proto(row.pose.position.sector);
  columns_.add_ids(row.id.value);
  columns_.add_sector(place->second);
  put(row.pose.position.local, *columns_.mutable_positions());
  put(row.pose.orientation.coeffs(), *columns_.mutable_orientations());
  put(row.linear_velocity, *columns_.mutable_linear_velocities());
  put(row.angular_velocity, *columns_.mutable_angular_velocities());
  columns_.add_asleep(row.asleep);
}

absl::Status append_rows(const v1::BodyColumns& columns, std::vector<BodyRow>& rows) {
  if (!agree(columns)) return absl::DataLossError("states of bodies in columns of different lengths");
  rows.reserve(rows.size() + static_cast<std::size_t>(columns.ids_size()));
  for (int n = 0; n < columns.ids_size(); ++n) {
    BodyRow& row = rows.emplace_back();
    row.id = BodyId{columns.ids(n)};
    row.pose.position = {from_proto(columns.sectors(static_cast<int>(columns.sector(n)))),
                         Eigen::Vector3d(&columns.positions().Get(3 * n))};
    row.pose.orientation = Eigen::Quaterniond(&columns.orientations().Get(4 * n));
    row.linear_velocity = Eigen::Vector3d(&columns.linear_velocities().Get(3 * n));
    row.angular_velocity = Eigen::Vector3d(&columns.angular_velocities().Get(3 * n));
    row.asleep = columns.asleep(n);
  }
  return absl::OkStatus();
}

}  // namespace tessera
