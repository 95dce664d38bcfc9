// Borders do not affect physics, tested with the quick scenes of the experiment; docs/seams.md has the rest.
#include <gtest/gtest.h>

#include <algorithm>

#include "experiments/seams/hashes.h"
#include "experiments/seams/runner.h"

namespace tessera::seams {
namespace {

constexpr Placement kWithSeams[] = {Placement::kLocal, Placement::kCorner};

Course course_of(const Scene& scene, Placement placement, Policy policy, Precision precision) {
  return run(scene, stage(scene, placement, policy, precision).value(), scene.ticks).value();
}

std::vector<Scene> scenes_without(std::vector<Scene> scenes, const std::string& left_out) {
  std::erase_if(scenes, [&](const Scene& scene) { return scene.name == left_out; });
  return scenes;
}

void expect_unfelt(const Scene& scene) {
  const Course reference = course_of(scene, Placement::kReference, Policy::kIsland, Precision::kFloat32);
  EXPECT_TRUE(scene.stands(reference, reference)) << scene.name;
  for (const Placement placement : kWithSeams) {
    const Course course = course_of(scene, placement, Policy::kIsland, Precision::kFloat32);
    EXPECT_TRUE(scene.stands(course, reference)) << scene.name << ", " << name_of(placement);
    EXPECT_EQ(course.duplicate_events, 0u) << scene.name << ", " << name_of(placement);
    EXPECT_EQ(course.broken_events, 0u) << scene.name << ", " << name_of(placement);
  }
}

TEST(SeamExperiment, StacksStandOnEverySeam) {
  for (const Scene& scene : stack_scenes()) expect_unfelt(scene);
}

TEST(SeamExperiment, DominoesFallThroughFourSectors) {
  expect_unfelt(scenes_without(toppling_scenes(), "cradle")[0]);
}

TEST(SeamExperiment, WhatCrossesOrRestsOnASeamDoesNotFeelIt) {
  for (const Scene& scene : crossing_scenes()) expect_unfelt(scene);
}

TEST(SeamExperiment, CollisionsOnASeamKeepTheirMomentum) {
  for (const Scene& scene : collision_scenes()) {
    for (const Placement placement : kWithSeams) {
      const Course course = course_of(scene, placement, Policy::kIsland, Precision::kFloat32);
      EXPECT_LE(course.momentum_drift, 1e-6) << scene.name << ", " << name_of(placement);
    }
  }
}

TEST(SeamExperiment, TheClonesOfThePaperLetATowerFall) {
  const std::vector<Scene> stacks = stack_scenes();
  const Scene& tower = *std::ranges::find(stacks, "tower_own", &Scene::name);
  const Course reference = course_of(tower, Placement::kReference, Policy::kClone1, Precision::kFloat32);
  EXPECT_TRUE(tower.stands(reference, reference));
  const Course cloned = course_of(tower, Placement::kLocal, Policy::kClone1, Precision::kFloat32);
  EXPECT_FALSE(tower.stands(cloned, reference));
}

TEST(SeamExperiment, TheSameBitsHoweverTheWorkIsSpread) {
  const HashOptions options{.seeds = 3, .shuffles = 3, .ticks = 30};
  for (const Scene& scene : stack_scenes()) {
    const Equality equality = compare_hashes(scene, Policy::kIsland, Precision::kFloat32, options).value();
    EXPECT_TRUE(equality.holds()) << scene.name;
  }
}

}  // namespace
}  // namespace tessera::seams
