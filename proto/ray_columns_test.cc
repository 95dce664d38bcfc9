#include "proto/ray_columns.h"

#include <gmock/gmock.h>

#include <functional>

namespace tessera {
namespace {

using ::testing::HasSubstr;

RayRow ray(std::uint64_t except, const SectorIndex& sector) {
  const auto x = static_cast<double>(except);
  return {{sector, {x, -x, 0.1}}, {0, x, -1}, 10 + x, BodyId{except}};
}

void expect_equal(const RayRow& one, const RayRow& other) {
  EXPECT_EQ(one.origin, other.origin);
  EXPECT_EQ(one.direction, other.direction);
  EXPECT_EQ(one.length, other.length);
  EXPECT_EQ(one.except, other.except);
}

v1::RaysQuery three() {
  v1::RaysQuery rays;
  RayWriter writer(rays);
  for (const RayRow& row : {ray(7, {1, 2, 3}), ray(0, {-1, 0, 0}), ray(4, {1, 2, 3})}) writer.add(row);
  return rays;
}

TEST(RayColumns, AreReadAsTheyWereWritten) {
  const v1::RaysQuery rays = three();
  EXPECT_EQ(rays.sectors_size(), 2) << "each once";
  const absl::StatusOr<RayReader> read = RayReader::of(rays);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), 3);
  expect_equal((*read)[0], ray(7, {1, 2, 3}));
  expect_equal((*read)[1], ray(0, {-1, 0, 0}));
  expect_equal((*read)[2], ray(4, {1, 2, 3}));
  const v1::RaysQuery none;
  EXPECT_EQ(RayReader::of(none)->size(), 0);
}

TEST(RayColumns, OneElementIsForAllRays) {
  v1::RaysQuery rays;
  for (const double x : {1, 2, 3}) rays.mutable_origins()->Add(x);
  for (const double x : {1, 0, 0, 0, 1, 0}) rays.mutable_directions()->Add(x);
  rays.add_lengths(5);
  const absl::StatusOr<RayReader> read = RayReader::of(rays);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), 2);
  expect_equal((*read)[0], {{{0, 0, 0}, {1, 2, 3}}, {1, 0, 0}, 5, {}});
  expect_equal((*read)[1], {{{0, 0, 0}, {1, 2, 3}}, {0, 1, 0}, 5, {}});
  rays.add_sectors()->set_i(7);
  EXPECT_EQ((*RayReader::of(rays))[1].origin.sector, (SectorIndex{7, 0, 0}));
  rays.add_sectors()->set_k(8);
  rays.add_sector(1);
  rays.add_except_by_ray(9);
  EXPECT_EQ((*RayReader::of(rays))[1].origin.sector, (SectorIndex{0, 0, 8}));
  EXPECT_EQ((*RayReader::of(rays))[1].except, BodyId{9});
}

// Of whoever sends them.
TEST(RayColumns, WrongOnesAreNamed) {
  const auto expect_refusal = [](const std::function<void(v1::RaysQuery&)>& spoil, const std::string& words) {
    v1::RaysQuery bad = three();
    spoil(bad);
    const absl::Status status = RayReader::of(bad).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(words));
  };
  expect_refusal([](v1::RaysQuery& rays) { rays.add_origins(1); },
                 "origins: 10 numbers must be 3 for each ray");
  expect_refusal([](v1::RaysQuery& rays) { rays.mutable_directions()->Truncate(6); },
                 "directions: 2 elements must be one for each of 3 rays, or one for all");
  expect_refusal([](v1::RaysQuery& rays) { rays.clear_lengths(); }, "lengths: 0 elements");
  expect_refusal([](v1::RaysQuery& rays) { rays.add_except_by_ray(1); }, "sector: 3 elements");
  expect_refusal([](v1::RaysQuery& rays) { rays.set_sector(2, 2); },
                 "sector[2] = 2 must be below 2, the number of sectors");
}

TEST(HitColumns, AreReadAsTheyWereWritten) {
  v1::HitColumns columns;
  HitWriter writer(columns);
  writer.add({});
  writer.add({BodyId{3}, 2.5, {{1, 0, 0}, {1, 2, 3}}, {0, 0, 1}});
  writer.add({BodyId{4}, 0.5, {{1, 0, 0}, {4, 5, 6}}, {1, 0, 0}});
  EXPECT_EQ(columns.sectors_size(), 1) << "each once";
  std::vector<HitRow> rows;
  ASSERT_TRUE(append_rows(columns, rows).ok());
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].body, BodyId{});
  EXPECT_EQ(rows[1].body, BodyId{3});
  EXPECT_EQ(rows[1].distance, 2.5);
  EXPECT_EQ(rows[2].position, (WorldPosition{{1, 0, 0}, {4, 5, 6}}));
  EXPECT_EQ(rows[2].normal, Eigen::Vector3d(1, 0, 0));
  columns.set_sector(1, 1);
  EXPECT_EQ(append_rows(columns, rows).code(), absl::StatusCode::kDataLoss);
  columns.set_sector(1, 0);
  columns.add_distances(1);
  EXPECT_EQ(append_rows(columns, rows).code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace tessera
