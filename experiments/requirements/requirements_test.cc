// Worlds differ only in the omitted choice, and the rows show its effect.
#include "experiments/requirements/requirements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <set>
#include <string>

#include "experiments/requirements/choices.h"
#include "experiments/requirements/spread.h"
#include "lpss/model/validate.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

const Progress kNoProgress = [](std::uint64_t, std::uint64_t, const Report&) { return true; };

std::set<SectorIndex> sectors_of(const WorldDescription& world) {
  std::set<SectorIndex> sectors;
  for (const BodyDescription& body : world.bodies) sectors.insert(body.pose.position.sector);
  return sectors;
}

std::vector<std::string> names_of(const std::vector<Choice>& choices) {
  std::vector<std::string> names;
  for (const Choice& choice : choices) names.push_back(choice.name);
  return names;
}

std::map<std::string, Row> rows_by_choice(Report& report) {
  std::map<std::string, Row> rows;
  for (const Row& row : report.table("rows")) rows[row["choice"]] = row;
  return rows;
}

TEST(Choices, OfSectorsThatAreEmptyOnlyWhereThereAreSome) {
  EXPECT_THAT(names_of(choices_for(tower_world(WorldSettings(), 2, Eigen::Vector3d::Zero()))),
              ::testing::ElementsAre("sleep", "coast", "adapt", "sweep"));
  EXPECT_THAT(names_of(choices_for(sparse_world(WorldSettings(), 2))),
              ::testing::ElementsAre("sleep", "coast", "adapt", "sweep", "no-search", "no-world"));
}

TEST(Choices, LoneBodiesHaveASectorEach) {
  for (const int count : {1, 60, 1000}) {
    const WorldDescription world = sparse_world(WorldSettings(), count);
    EXPECT_EQ(world.bodies.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(sectors_of(world).size(), world.bodies.size());
    EXPECT_TRUE(validate(world).ok()) << validate(world);
  }
}

TEST(Choices, PebblesAreWhereBodiesAreAndKeepersWhereNoneIs) {
  const WorldDescription world = sparse_world(WorldSettings(), 1000);
  WorldDescription pebbles = world;
  add_pebbles(pebbles);
  EXPECT_EQ(pebbles.bodies.size(), 2 * world.bodies.size());
  EXPECT_EQ(sectors_of(pebbles), sectors_of(world));
  EXPECT_TRUE(validate(pebbles).ok()) << validate(pebbles);
  WorldDescription keepers = world;
  add_keepers(keepers);
  // Ten bodies 150 m apart span 12 sectors of 128 m.
  EXPECT_EQ(keepers.bodies.size(), 12u * 12 * 12);
  EXPECT_EQ(sectors_of(keepers).size(), keepers.bodies.size());
  EXPECT_TRUE(validate(keepers).ok()) << validate(keepers);
}

TEST(Choices, ADisturbanceLeavesWhatDoesNotMove) {
  const WorldDescription world = tower_world(WorldSettings(), 4, Eigen::Vector3d(64, 0, 0));
  WorldDescription moved = world;
  ASSERT_TRUE(disturb(moved, 0.25).ok());
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    const bool is_dynamic = world.bodies[i].properties.motion == Motion::kDynamic;
    const Eigen::Vector3d by = relative_to(moved.bodies[i].pose.position,
                                           world.bodies[i].pose.position.sector, world.settings.sector_size) -
                               world.bodies[i].pose.position.local;
    EXPECT_NEAR(by.norm(), is_dynamic ? 0.25 : 0, 1e-12) << i;
  }
}

TEST(Spread, SaysHowFarTheMiddleAndTheWorstAreApart) {
  const Positions here = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  const Positions there = {{0, 3, 4}, {1, 0, 0}, {0, 0, 2}};
  const Spread spread(distances(here, there));
  EXPECT_EQ(spread.middle, 2.0);
  EXPECT_EQ(spread.largest, 5.0);
}

TEST(Spread, IsNullWhereNothingCanBeSaid) {
  EXPECT_TRUE(Spread({}).largest.is_null());
  EXPECT_TRUE(Spread({1, std::numeric_limits<double>::quiet_NaN()}).middle.is_null());
}

TEST(RequirementsExperiment, LoneBodiesFlyTheSameWhateverIsDoneForThem) {
  const RequirementsSubject sparse{"sparse", sparse_world(WorldSettings(), 30), 0.4, 0.2};
  absl::StatusOr<Report> report = measure_requirements_of({&sparse, 1}, kNoProgress);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_THAT(report->misses, ::testing::IsEmpty());
  std::map<std::string, Row> rows = rows_by_choice(*report);
  EXPECT_EQ(rows.size(), 6u);
  for (const auto& [choice, row] : rows) {
    EXPECT_EQ(row["error_m"], 0.0) << row;
    const bool has_more_bodies = choice == "no-search" || choice == "no-world";
    EXPECT_EQ(row["hash_on"] == row["hash_off"], !has_more_bodies) << row;
  }
  const Row& world = report->table("worlds").at(0);
  EXPECT_EQ(world["bodies"], 30);
  EXPECT_EQ(world["sectors"], 30);
  for (const Row& row : report->table("errors")) {
    EXPECT_EQ(row["error_m"], 0.0) << row;
    EXPECT_GT(row["noise_m"], 0.0) << row;
    EXPECT_EQ(row["to_reference_on_m"], row["to_reference_off_m"]) << row;
    EXPECT_TRUE(row["error_at_rest_m"].is_null()) << row;
  }
}

TEST(RequirementsExperiment, WhatIsAtRestStaysWhereItWas) {
  const WorldDescription tower = tower_world(WorldSettings(), 2, Eigen::Vector3d::Zero());
  const RequirementsSubject subject{"tower", tower, 3, 0.1};
  absl::StatusOr<Report> report = measure_requirements_of({&subject, 1}, kNoProgress);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->table("worlds").at(0)["asleep"], 2);
  const Row row = rows_by_choice(*report).at("sleep");
  EXPECT_EQ(row["error_m"], 0.0) << "nothing sleeps by then";
  EXPECT_NE(row["hash_on"], row["hash_off"]);
  EXPECT_DOUBLE_EQ(row["saving"].get<double>() * row["cpu_us_on"].get<double>(),
                   row["cpu_us_off"].get<double>());
  for (const Row& errors : report->table("errors")) {
    if (errors["choice"] != "sleep") continue;
    EXPECT_GT(errors["error_at_rest_m"], 0.0) << errors;
    EXPECT_LT(errors["error_at_rest_m"], 1e-3) << errors;
  }
}

TEST(RequirementsExperiment, EndsWhenAsked) {
  const RequirementsSubject sparse{"sparse", sparse_world(WorldSettings(), 2), 0.1, 0.1};
  const Progress stop = [](std::uint64_t, std::uint64_t, const Report&) { return false; };
  EXPECT_EQ(measure_requirements_of({&sparse, 1}, stop).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace tessera
