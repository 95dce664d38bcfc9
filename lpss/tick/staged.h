// Islands over several servers that these solve in step, each what it hosts.
//
// The order of contacts is the world's (solve_order.h). Contacts inside a sector and with what cannot be
// pushed concern one server. Those of a block are solved by every server that hosts one of their bodies, all
// alike: before the stage of the block has its turn in a sweep, these servers tell each other how their
// bodies in it move, and nobody replies. As all know what a block does to its bodies, a body is told of again
// only if something else has pushed it: mostly, that is once a sweep.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/tick/context.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/round.h"
#include "lpss/tick/ship.h"

namespace tessera {

// Takes up an island that this server solves in step with others: what is hosted here, and what others must
// know of it. `substeps` are those that the engine grants it; `outbox` by rank.
void plan_stages(Partition& partition, TickContext& context, const SeamIsland& island, int substeps,
                 std::vector<Shipment>& outbox);

// Solves what is staged, from exchange to exchange.
class StagedSolve {
 public:
  // With what the others told, which outlives this; so do the solvers, of which as many are made as it takes.
  StagedSolve(const Partition& partition, IslandPlan& plan, const std::vector<Shipment>& inbox,
              std::vector<std::unique_ptr<StagedSolver>>& solvers);

  // Goes on up to the next exchange in which this server takes part. Nothing if there is none: all is solved.
  std::optional<Round> go_on();

  // What others sent in that exchange, by rank.
  void take(const std::vector<Motions>& inbox);

  // The sweeps over all stages.
  int sweeps() const { return sweeps_; }

 private:
  // The bodies that this server and another tell each other of before a stage: places in the task, ascending.
  struct Traffic {
    std::vector<std::size_t> mine;
    std::vector<std::size_t> theirs;
  };
  using TrafficByRank = std::vector<Traffic>;

  struct Job {
    StagedSolver* solver = nullptr;
    SolveJob job;
    int sweeps = 0;
    std::array<TrafficByRank, kSeamStages> traffic;
  };

  class Builder;
  // The traffic of a job before the stage that is next; null if the job has no such stage or sweep.
  const TrafficByRank* traffic_of(const Job& job) const;
  std::optional<Round> exchange() const;
  void solve_next_stage();

  std::size_t servers_;
  std::vector<Job> jobs_;  // in an order that all servers know; solvers refer to them
  int sweeps_ = 0;
  int sweep_ = 0;
  ContactStage stage_ = 0;
  bool is_told_ = false;  // before this stage
};

}  // namespace tessera
