// Rows of the experiment describe what happened, including crashes and refusals.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <set>

#include "experiments/extremes/figures.h"
#include "experiments/extremes/row.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

constexpr ExperimentOptions kQuick{Precision::kFloat32, true, ""};

Scene scene_of(const std::string& group, const std::string& name) {
  const std::vector<Scene> scenes = all_scenes();
  const auto found = std::find_if(scenes.begin(), scenes.end(), [&](const Scene& scene) {
    return scene.group == group && scene.name == name;
  });
  EXPECT_NE(found, scenes.end()) << group << " " << name;
  return found == scenes.end() ? Scene() : *found;
}

// A ball that falls for a few ticks.
Scene falling(const Figure& figure) {
  Scene scene;
  scene.group = "test";
  scene.name = "fall";
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(settings);
    builder.add("ball", builder.shape(Sphere{0.5}), 1, Eigen::Vector3d::Zero());
    return builder.world();
  };
  scene.lasts = {20, 10};
  scene.asks = {figure, "m", 1, "It fell a little.", "It fell far."};
  return scene;
}

Row row_of(const Report& report) {
  EXPECT_EQ(report.tables.size(), 1u);
  EXPECT_EQ(report.tables.at(0).rows.size(), 1u);
  return report.tables.at(0).rows.at(0);
}

TEST(ExtremesExperiment, ARowSaysWhatHappenedAndHowFarItIsFromItsBound) {
  const Report report = measure(falling(farthest), kQuick);
  EXPECT_TRUE(report.misses.empty());
  const Row row = row_of(report);
  EXPECT_EQ(row["group"], "test");
  EXPECT_EQ(row["scene"], "fall");
  EXPECT_EQ(row["engine"], "f32");
  EXPECT_EQ(row["what"], "It fell a little.");
  const double time = 10 * WorldSettings().time_step;
  EXPECT_NEAR(row["figure"].get<double>(), kStandardGravity / 2 * time * time, 0.02);
  EXPECT_EQ(row["unit"], "m");
  EXPECT_EQ(row["bound"], 1.0);
  EXPECT_EQ(row["within"], true);
  EXPECT_EQ(row["ticks"], 10);
  EXPECT_TRUE(row["wall_s"].is_number());
}

TEST(ExtremesExperiment, WhatIsBeyondItsBoundIsAMiss) {
  Scene scene = falling(farthest);
  scene.asks.bound = 0.01;
  const Report report = measure(scene, kQuick);
  EXPECT_EQ(row_of(report)["within"], false);
  EXPECT_EQ(row_of(report)["what"], "It fell far.");
  EXPECT_EQ(report.misses.size(), 1u);
}

TEST(ExtremesExperiment, ALostNumberIsAMiss) {
  const auto lost = [](const Moment&, const Moment& now) {
    return now.tick < 3 ? 0 : std::numeric_limits<double>::quiet_NaN();
  };
  const Report report = measure(falling(lost), kQuick);
  EXPECT_TRUE(row_of(report)["figure"].is_null());
  EXPECT_EQ(row_of(report)["ticks"], 3);
  EXPECT_EQ(report.misses.size(), 1u);
}

TEST(ExtremesExperiment, ACrashIsAMiss) {
  const auto crash = [](const Moment&, const Moment&) -> double { std::abort(); };
  const Report report = measure_apart(falling(crash), kQuick).value();
  EXPECT_TRUE(row_of(report)["figure"].is_null());
  EXPECT_EQ(row_of(report)["within"], false);
  EXPECT_EQ(report.misses.size(), 1u);
}

TEST(ExtremesExperiment, ARefusalIsAnAnswerWhereTheWorldMayBeRefused) {
  Scene scene = scene_of("input", "mass_no_number");
  const Report refused = measure(scene, kQuick);
  EXPECT_EQ(row_of(refused)["within"], true);
  EXPECT_EQ(row_of(refused)["ticks"], 0);
  scene.may_be_refused = false;
  EXPECT_EQ(row_of(measure(scene, kQuick))["within"], false);
}

TEST(ExtremesExperiment, ScenesHaveNamesOfTheirOwnAndEnd) {
  std::set<std::pair<std::string, std::string>> names;
  for (const Scene& scene : all_scenes()) {
    EXPECT_TRUE(names.insert({scene.group, scene.name}).second) << scene.group << " " << scene.name;
    EXPECT_GT(scene.lasts.ticks, 0u) << scene.name;
    EXPECT_GT(scene.lasts.quick_ticks, 0u) << scene.name;
    EXPECT_FALSE(scene.asks.unit.empty() || scene.asks.holds.empty() || scene.asks.fails.empty())
        << scene.name;
  }
}

TEST(ExtremesExperiment, FarAwayIsAsAtTheOrigin) {
  Scene scene = scene_of("distance", "collision_at_2^62_sectors");
  const Row row = row_of(measure(scene, kQuick));
  EXPECT_EQ(row["within"], true);
  EXPECT_EQ(row["figure"], 0.0);
  EXPECT_EQ(row["ticks"], scene.lasts.quick_ticks);
  // A body that moves differently from the scene at the origin is detected.
  scene.world = [far = scene.world](const WorldSettings& settings) {
    WorldDescription world = far(settings);
    world.bodies.back().pose.position.local.x() += 1e-5;
    return world;
  };
  EXPECT_EQ(row_of(measure(scene, kQuick))["within"], false);
}

}  // namespace
}  // namespace tessera::extremes
