// Solving: the islands of this server become new velocities, on all its threads.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "lpss/tick/context.h"
#include "lpss/tick/divergences.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"
#include "lpss/tick/ship.h"

namespace tessera {

// Solvers for as many threads as want one.
class SolverPool {
 public:
  explicit SolverPool(Engine& engine) : engine_(engine) {}

  std::unique_ptr<IslandSolver> take();
  void put_back(std::unique_ptr<IslandSolver> solver);

 private:
  Engine& engine_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<IslandSolver>> idle_;
};

// What a server solves by itself: bit by bit while it waits for others, and the rest in the end.
class JobQueue {
 public:
  // `dt` in s. What is passed by reference outlives the queue.
  JobQueue(double dt, const ParallelFor& parallel, SolverPool& solvers)
      : dt_(dt), parallel_(parallel), solvers_(solvers) {}

  void add(std::vector<SolveJob> jobs);

  // About this share (0 to 1) of all the work that was added.
  void run(double share);
  void finish() { run(1); }

  // Of the bodies that diverged so far.
  const BlamedJoints& blamed() const { return blamed_; }

 private:
  // Jobs that touch the same kinematic bodies: engines keep solver state in these, so that such jobs must run
  // one after the other.
  struct Group {
    std::vector<SolveJob> jobs;
    std::size_t weight = 0;
  };

  double dt_;
  const ParallelFor& parallel_;
  SolverPool& solvers_;
  std::vector<Group> groups_;
  std::size_t next_ = 0;
  std::size_t weight_ = 0;
  std::mutex mutex_;  // of what follows
  BlamedJoints blamed_;
};

// Islands of which other servers ship parts.
class ShippedIslands {
 public:
  // Adds their jobs to `queue`.
  ShippedIslands(Partition& partition, IslandPlan& plan, const std::vector<Shipment>& inbox, JobQueue& queue);

  // What goes back, by rank, once they are solved.
  std::vector<Solution> solutions(const SectorMap& map, const BlamedJoints& blamed) const;

 private:
  std::vector<std::unique_ptr<Carriers>> carriers_;
  std::vector<std::vector<JointRecord>> joints_;  // of the islands; jobs refer to them
};

}  // namespace tessera
