// Islands become new velocities, in any order and on any threads.
#include "lpss/tick/solve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

void add_crash(TestWorld& world, std::uint64_t first, const SectorIndex& home) {
  world.add(moving(box(first, home, {0, 0, 0}), {1, 0, 0}));
  world.add(moving(box(first + 1, home, {0.984375, 0, 0}), {-1, 0.5, 0}));
}

TEST(Solve, TheOrderOfIslandsDoesNotMatter) {
  TestWorld forwards;
  TestWorld backwards;
  for (TestWorld* world : {&forwards, &backwards}) {
    add_crash(*world, 1, kLow);
    add_crash(*world, 3, kHigh);
    world->exchange();
    world->detect();
    world->connect();
    world->plan();
    std::vector<SolveJob>& jobs = world->contexts[0].plan.jobs;
    jobs.clear();
    for (const SectorIndex& home : {kLow, kHigh}) {
      TaskBuilder builder((*world)[0]);
      builder.begin_island();
      builder.add(world->sector(home), world->sector(home).components.at(0));
      builder.end_island();
      jobs.push_back(builder.build());
    }
  }
  forwards.solve();
  SolverPool solvers(backwards[0].engine);
  JobQueue queue(backwards[0].dt(), kLastFirst, solvers);
  queue.add(std::move(backwards.contexts[0].plan.jobs));
  queue.run(0.5);
  queue.finish();
  for (const std::uint64_t id : {1, 2, 3, 4}) {
    EXPECT_EQ(bits(forwards.state(id)), bits(backwards.state(id))) << "body " << id;
  }
  EXPECT_LE(forwards.state(1).linear_velocity[0], forwards.state(2).linear_velocity[0] + 1e-6)
      << "they no longer approach each other";
}

TEST(Solve, ASolverThatWasPutBackIsTakenAgain) {
  TestPartition partition;
  SolverPool solvers(partition->engine);
  std::unique_ptr<IslandSolver> first = solvers.take();
  const std::unique_ptr<IslandSolver> second = solvers.take();
  EXPECT_NE(first, second);
  const IslandSolver* known = first.get();
  solvers.put_back(std::move(first));
  EXPECT_EQ(solvers.take().get(), known);
}

}  // namespace
}  // namespace tessera
