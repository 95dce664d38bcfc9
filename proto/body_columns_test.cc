#include "proto/body_columns.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

BodyRow row(std::uint64_t id, const SectorIndex& sector) {
  const auto x = static_cast<double>(id);
  return {BodyId{id},
          {{sector, {x, -x, 0.1}}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)},
          {1, 2, x},
          {x, 5, 6},
          id % 2 == 0};
}

void expect_equal(const BodyRow& one, const BodyRow& other) {
  EXPECT_EQ(one.id, other.id);
  EXPECT_EQ(one.pose.position, other.pose.position);
  EXPECT_EQ(one.pose.orientation.coeffs(), other.pose.orientation.coeffs());
  EXPECT_EQ(one.linear_velocity, other.linear_velocity);
  EXPECT_EQ(one.angular_velocity, other.angular_velocity);
  EXPECT_EQ(one.asleep, other.asleep);
}

TEST(BodyColumns, AreReadAsTheyWereWritten) {
  const std::vector<BodyRow> rows = {row(7, {1, 2, 3}), row(2, {-1, 0, 0}), row(4, {1, 2, 3})};
  v1::BodyColumns columns;
  ColumnWriter writer(columns);
  for (const BodyRow& one : rows) writer.add(one);
  EXPECT_EQ(columns.sectors_size(), 2) << "each once";
  std::vector<BodyRow> read = {row(1, {})};
  ASSERT_TRUE(append_rows(columns, read).ok());
  ASSERT_EQ(read.size(), 4u);
  expect_equal(read[0], row(1, {}));
  for (std::size_t n = 0; n < 3; ++n) expect_equal(read[n + 1], rows[n]);
  EXPECT_TRUE(append_rows(v1::BodyColumns(), read).ok()) << "there may be none";
}

// Of whoever sends them.
TEST(BodyColumns, OfDifferentLengthsAreRefused) {
  v1::BodyColumns good;
  ColumnWriter(good).add(row(1, {}));
  const auto expect_refusal = [&](const auto& spoil) {
    v1::BodyColumns bad = good;
    spoil(bad);
    std::vector<BodyRow> rows;
    EXPECT_EQ(append_rows(bad, rows).code(), absl::StatusCode::kDataLoss) << bad.ShortDebugString();
    EXPECT_TRUE(rows.empty());
  };
  expect_refusal([](v1::BodyColumns& columns) { columns.add_ids(2); });
  expect_refusal([](v1::BodyColumns& columns) { columns.clear_sectors(); });
  expect_refusal([](v1::BodyColumns& columns) { columns.set_sector(0, 1); });
  expect_refusal([](v1::BodyColumns& columns) { columns.add_sector(0); });
  expect_refusal([](v1::BodyColumns& columns) { columns.add_positions(0); });
  expect_refusal([](v1::BodyColumns& columns) { columns.mutable_orientations()->RemoveLast(); });
  expect_refusal([](v1::BodyColumns& columns) { columns.clear_linear_velocities(); });
  expect_refusal([](v1::BodyColumns& columns) { columns.add_angular_velocities(0); });
  expect_refusal([](v1::BodyColumns& columns) { columns.clear_asleep(); });
}

}  // namespace
}  // namespace tessera
