#include "cli/tune/tune.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "cli/measure/own_process.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

const Progress kSilent = [](std::uint64_t, std::uint64_t, const Report&) { return true; };

// Two balls without gravity that graze between two ticks.
WorldDescription grazing_balls() {
  WorldBuilder builder{WorldSettings()};
  builder.world().settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  const ShapeId ball = builder.shape(Sphere{0.5});
  for (const int side : {-1, 1}) {
    BodyDescription& body = builder.add(side < 0 ? "left" : "right", ball, 1, {side * 2.07, side * 0.1, 0});
    body.linear_velocity.x() = -side * 5;
    body.properties.restitution = 0.5;
  }
  return builder.world();
}

TEST(TuneTest, ChoosesTheCheapestThatMeetsAndAFinerRunAgrees) {
  const WorldDescription world = grazing_balls();
  const TuneOptions options{.max_error = 0.025, .horizon = 1};
  const Moments moments = Moments::within(options.horizon, 1.0 / 30);
  absl::StatusOr<Report> report = tune(world, options, kSilent);
  ASSERT_TRUE(report.ok()) << report.status();
  const std::vector<Row>& chosen = report->table("chosen");
  ASSERT_EQ(chosen.size(), 1u);
  const absl::StatusOr<Knobs> knobs = knobs_from_json(chosen.front());
  ASSERT_TRUE(knobs.ok()) << knobs.status();
  for (const Row& row : report->table("rows")) {
    if (row["meets"].get<bool>()) break;
    EXPECT_FALSE(row["error_m"].is_number() && row["error_m"].get<double>() <= options.max_error);
  }
  absl::StatusOr<Report> checked = in_own_process([&]() -> absl::StatusOr<Report> {
    Knobs finest = reference_knobs(world.settings, /*coarser=*/false);
    finest.set(&WorldSettings::time_step, finest.values().time_step / 2);
    Report result;
    result.table("finest") = to_rows(run_trial(with_knobs(world, finest).value(), moments)->samples);
    return result;
  });
  ASSERT_TRUE(checked.ok()) << checked.status();
  absl::StatusOr<Report> ran = in_own_process([&]() -> absl::StatusOr<Report> {
    Report result;
    result.table("chosen") = to_rows(run_trial(with_knobs(world, *knobs).value(), moments)->samples);
    return result;
  });
  ASSERT_TRUE(ran.ok()) << ran.status();
  const double error =
      error_between(samples_from(checked->table("finest")), samples_from(ran->table("chosen")));
  EXPECT_LE(error, 1.5 * options.max_error);
}

TEST(TuneTest, SaysSoWhereNothingMeets) {
  const WorldDescription world = tower_world(WorldSettings(), 3, Eigen::Vector3d::Zero());
  absl::StatusOr<Report> report = tune(world, {.max_error = 1e-15, .horizon = 0.2}, kSilent);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->table("chosen").empty());
  EXPECT_THAT(report->misses, ::testing::ElementsAre(::testing::HasSubstr("nothing that was tried")));
}

TEST(TuneTest, EndsWhenAsked) {
  const WorldDescription world = tower_world(WorldSettings(), 2, Eigen::Vector3d::Zero());
  const Progress stop = [](std::uint64_t, std::uint64_t, const Report&) { return false; };
  EXPECT_EQ(tune(world, {.horizon = 0.1}, stop).status().code(), absl::StatusCode::kCancelled);
}

TEST(MomentsTest, ComeBetweenTicksOfAllStepsAndReachTheHorizon) {
  for (const double horizon : {0.1, 0.2, 1.0, 2.0, 8.0, 60.0}) {
    const Moments moments = Moments::within(horizon, 1.0 / 30);
    EXPECT_LE(moments.count, 32) << horizon;
    EXPECT_GE(moments.interval * moments.count, horizon - 1e-9) << horizon;
    EXPECT_LT(moments.interval * (moments.count - 1), horizon) << horizon;
    for (const int rate : {30, 60, 120, 240, 480}) {
      EXPECT_NEAR(std::remainder(moments.interval * rate, 1), 0, 1e-9) << horizon << ' ' << rate;
    }
  }
}

TEST(FrontTest, OnItMoreCostMeansLessError) {
  std::vector<Row> rows;
  for (const auto& [cost, error] : {std::pair{1.0, 5.0}, {2.0, 6.0}, {3.0, 1.0}, {4.0, 1.0}, {5.0, 0.5}}) {
    rows.push_back({{"cost_us", cost}, {"error_m", error}});
  }
  rows.push_back({{"cost_us", 0.5}, {"error_m", nullptr}});
  mark_front(rows, {});
  std::vector<bool> front;
  for (const Row& row : rows) front.push_back(row["front"]);
  EXPECT_THAT(front, ::testing::ElementsAre(true, false, true, false, true, false));
}

}  // namespace
}  // namespace tessera
