// Solving: the islands of this server become new velocities, on all its threads.
#pragma once

#include <cstddef>
#include <deque>
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

  // Returns the number of the first of these jobs.
  std::size_t add(std::vector<SolveJob> jobs);

  // About this share (0 to 1) of all the work that was added.
  void run(double share);
  void finish() { run(1); }

  // Once a job has been solved.
  const SolvedTask& solved(std::size_t job) const { return jobs_[job].solved; }

  // Of the bodies that diverged so far.
  const BlamedJoints& blamed() const { return blamed_; }

  // Of a job that has been solved: what its joint with this id gave and bore, which lives in it. The job is
  // one island.
  const JointLoads& loads(std::size_t job, JointId id) const;

  // Calls visit(JointId, JointLoads) for the joints of all jobs, which have been solved.
  template <typename Visit>
  void for_each_joint(Visit&& visit) const {
    for (const auto& [job, solved] : jobs_) {
      for (std::size_t n = 0; n < solved.joint_loads.size(); ++n)
        visit(job.task.joints[n].id, solved.joint_loads[n]);
    }
  }

 private:
  struct Job {
    SolveJob job;
    SolvedTask solved;
  };

  double dt_;
  const ParallelFor& parallel_;
  SolverPool& solvers_;
  std::deque<Job> jobs_;
  std::vector<Job*> order_;  // in which they are solved
  std::size_t next_ = 0;     // in it
  std::size_t weight_ = 0;
  std::mutex mutex_;  // of what follows
  BlamedJoints blamed_;
};

// Islands of which other servers ship parts.
class ShippedIslands {
 public:
  // Adds their jobs to `queue`. The inbox outlives them.
  ShippedIslands(IslandPlan& plan, const std::vector<Shipment>& inbox, JobQueue& queue);

  // What goes back, by rank, once they are solved.
  std::vector<Solution> solutions() const;

 private:
  struct Parcel {
    Rank from = 0;
    BodyId island;
    std::size_t job = 0;
    std::size_t bodies_end = 0;  // of its bodies among those of the job that were shipped
    std::size_t pairs_end = 0;
    const ShippedIsland* shipped = nullptr;
  };

  std::size_t servers_;
  const JobQueue& queue_;
  std::vector<Parcel> parcels_;  // by job
};

}  // namespace tessera
