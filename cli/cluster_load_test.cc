#include "cli/cluster_load.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace tessera::cli {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uint64_t kHere = 0xa;
constexpr std::uint64_t kThere = 0xb;
constexpr SectorIndex kFar = {std::int64_t{1} << 62, 0, -1};

BodySample body(SectorIndex sector, std::uint64_t server, bool asleep) {
  BodySample sample;
  sample.pose.position.sector = sector;
  sample.server = server;
  sample.asleep = asleep;
  return sample;
}

ServerStatus server(std::uint64_t node, std::uint64_t bodies, std::uint64_t memory) {
  ServerStatus status;
  status.node = node;
  status.bodies = bodies;
  status.peak_rss_bytes = memory;
  status.takes_part = true;
  return status;
}

// Two sectors of `kHere`, one of which has clones only, and a far one of `kThere`.
ClusterLoad some_load() {
  BodyFrame bodies;
  bodies.bodies = {body({0, 0, 0}, kHere, false), body({0, 0, 0}, kHere, true), body({0, 0, 0}, kHere, true),
                   body(kFar, kThere, false), body(kFar, kThere, false)};
  SeamFrame seams;
  seams.clones = {{BodyId{1}, {1, 0, 0}, kHere}, {BodyId{2}, {1, 0, 0}, kHere}, {BodyId{2}, kFar, kThere}};
  ClusterStatus status;
  status.state = "paused";
  status.servers = {server(kHere, 3, 90'000'000), server(kThere, 2, 10'000'000)};
  return cluster_load(status, sector_loads(bodies, seams));
}

std::vector<SectorIndex> order_of(const ClusterLoad& load) {
  std::vector<SectorIndex> order;
  for (const SectorLoad& sector : *load.sectors) order.push_back(sector.sector);
  return order;
}

// A world of a row of sectors with a body each, on as many servers.
ClusterLoad long_load(std::size_t size) {
  BodyFrame bodies;
  ClusterStatus status;
  for (std::size_t place = 0; place < size; ++place) {
    bodies.bodies.push_back(body({static_cast<std::int64_t>(place), 0, 0}, place, false));
    status.servers.push_back(server(place, 1, 0));
  }
  return cluster_load(status, sector_loads(bodies, {}));
}

std::ptrdiff_t lines_of(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

TEST(ClusterLoadTest, BodiesAndClonesAreCountedBySector) {
  const ClusterLoad load = some_load();
  ASSERT_EQ(load.sectors->size(), 3);
  const SectorLoad& here = load.sectors->at(0);
  EXPECT_EQ(here.sector, (SectorIndex{0, 0, 0}));
  EXPECT_EQ(here.server, kHere);
  EXPECT_EQ(here.bodies, 3);
  EXPECT_EQ(here.awake, 1);
  EXPECT_EQ(here.clones, 0);
  const SectorLoad& between = load.sectors->at(1);
  EXPECT_EQ(between.server, kHere);
  EXPECT_EQ(between.bodies, 0);
  EXPECT_EQ(between.clones, 2);
  EXPECT_EQ(load.sectors->at(2).sector, kFar);
}

TEST(ClusterLoadTest, ServersHaveTheBodiesAwakeOfTheirSectors) {
  const ClusterLoad load = some_load();
  EXPECT_EQ(load.servers.at(0).awake, 1);
  EXPECT_EQ(load.servers.at(1).awake, 2);
}

TEST(ClusterLoadTest, BusiestComeFirst) {
  ClusterLoad load = some_load();
  sort_by(kSortDefault, load);
  EXPECT_THAT(order_of(load), ElementsAre(kFar, SectorIndex{0, 0, 0}, SectorIndex{1, 0, 0}));
  EXPECT_EQ(load.servers.front().node, kThere);
}

TEST(ClusterLoadTest, SortsByAnyColumnAndEqualsByLoadAndPlace) {
  ClusterLoad load = some_load();
  sort_by("clones", load);
  EXPECT_THAT(order_of(load), ElementsAre(SectorIndex{1, 0, 0}, kFar, SectorIndex{0, 0, 0}));
  EXPECT_EQ(load.servers.front().node, kThere) << "equal by clones";
  sort_by("memory", load);
  EXPECT_EQ(load.servers.front().node, kHere);
  EXPECT_EQ(order_of(load).front(), kFar) << "sectors have no such column";
  ClusterLoad level = long_load(4);
  sort_by(kSortDefault, level);
  EXPECT_EQ(order_of(level), order_of(long_load(4)));
}

TEST(ClusterLoadTest, ColumnsToSortByAreThoseOfTheTables) {
  EXPECT_THAT(sort_columns(),
              ElementsAre("awake", "bodies", "clones", "sectors", "p50", "p99", "sent", "memory"));
  const std::string text = to_text(some_load(), {}, std::nullopt);
  for (const std::string& column : sort_columns()) EXPECT_THAT(text, HasSubstr("  " + column));
}

TEST(ClusterLoadTest, TablesAreForPeople) {
  ClusterLoad load = some_load();
  sort_by(kSortDefault, load);
  EXPECT_THAT(to_text(load, {}, std::nullopt),
              HasSubstr("\n"
                        "server  awake  bodies  clones  sectors      p50      p99  sent  memory\n"
                        "b           2       2       0        0  0.00 ms  0.00 ms  0 MB   10 MB\n"
                        "a           1       3       0        0  0.00 ms  0.00 ms  0 MB   90 MB\n"
                        "\n"
                        "sector                        server  awake  bodies  clones\n"
                        "(4611686018427387904, 0, -1)  b           2       2       1\n"
                        "(0, 0, 0)                     a           1       3       0\n"
                        "(1, 0, 0)                     a           0       0       2\n"));
}

TEST(ClusterLoadTest, OneTableCanBeLeftOut) {
  const ClusterLoad load = some_load();
  EXPECT_THAT(to_text(load, {.sectors = false}, std::nullopt),
              AllOf(HasSubstr("memory"), Not(HasSubstr("(0, 0, 0)"))));
  EXPECT_THAT(to_text(load, {.servers = false}, std::nullopt),
              AllOf(Not(HasSubstr("memory")), HasSubstr("(0, 0, 0)")));
}

TEST(ClusterLoadTest, WhatDoesNotFitIsCounted) {
  const ClusterLoad load = long_load(100);
  EXPECT_EQ(lines_of(to_text(load, {}, std::nullopt)), 3 + 2 + 100 + 2 + 100);
  for (const std::size_t lines : {9, 10, 25, 60, 210}) {
    EXPECT_LE(lines_of(to_text(load, {}, lines)), lines);
  }
  EXPECT_THAT(to_text(load, {}, 29),
              AllOf(HasSubstr("and 90 more servers"), HasSubstr("and 90 more sectors")));
  EXPECT_THAT(to_text(load, {.servers = false}, 29), HasSubstr("and 77 more sectors"));
  EXPECT_THAT(to_text(load, {}, 0), HasSubstr("and 100 more servers"));
}

TEST(ClusterLoadTest, TableThatNeedsLessLeavesTheRestToTheOther) {
  const ClusterLoad many = long_load(100);
  ClusterLoad few_servers = cluster_load({}, many.sectors);
  few_servers.servers.assign(many.servers.begin(), many.servers.begin() + 2);
  EXPECT_THAT(to_text(few_servers, {}, 29), HasSubstr("and 82 more sectors"));
  ClusterLoad few_sectors = many;
  few_sectors.sectors->resize(2);
  EXPECT_THAT(to_text(few_sectors, {}, 29), HasSubstr("and 82 more servers"));
}

TEST(ClusterLoadTest, SectorsThatAreNotKnownAreNotTakenForNone) {
  const ClusterLoad load = cluster_load(some_load().status, absl::AbortedError("the world was unloaded"));
  EXPECT_THAT(to_text(load, {}, std::nullopt), HasSubstr("\nno sectors: the world was unloaded\n"));
  EXPECT_EQ(to_json(load)["sectors_by_load"], nlohmann::json::array());
}

TEST(ClusterLoadTest, DataHasTheOrderOfTheTables) {
  ClusterLoad load = some_load();
  sort_by(kSortDefault, load);
  const nlohmann::json data = to_json(load);
  EXPECT_EQ(data["state"], "paused");
  EXPECT_EQ(data["servers"][0]["node"], "b");
  EXPECT_EQ(data["servers"][0]["bodies_awake"], 2);
  EXPECT_EQ(data["servers"][0]["peak_rss_bytes"], 10'000'000);
  EXPECT_EQ(data["sectors_by_load"][0], (nlohmann::json{{"sector", {std::int64_t{1} << 62, 0, -1}},
                                                        {"server", "b"},
                                                        {"bodies", 2},
                                                        {"bodies_awake", 2},
                                                        {"clones", 1}}));
}

}  // namespace
}  // namespace tessera::cli
