// Several partitions of one world in one process, their messages handed over directly: what a cluster
// computes, without the cluster. For tests and experiments.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "lpss/simulation/simulation.h"

namespace tessera {

class PartitionCluster {
 public:
  // Errors as Simulation::create(). `free_flight` as in PartitionOptions.
  static absl::StatusOr<std::unique_ptr<PartitionCluster>> create(const WorldDescription& world,
                                                                  std::uint32_t partitions, int threads = 1,
                                                                  bool free_flight = true);

  // Goes on from a snapshot. Errors as Simulation::restore().
  static absl::StatusOr<std::unique_ptr<PartitionCluster>> restore(const WorldSnapshot& world,
                                                                   std::uint32_t partitions, int threads = 1);

  // All that goes on after this tick, whatever the number of partitions.
  WorldSnapshot snapshot() const;

  // A shape for bodies that commands spawn; its id must be new.
  void add_shape(ShapeId id, const ShapeRef& shape);
  void add_module(const std::shared_ptr<const ProgramModule>& module);  // that this process can run

  void step(std::span<const Command> commands = {});

  // Hears of each message from one partition to another, from now on.
  using Listener = std::function<void(Rank from, Rank to, const RoundMessage& message)>;
  void listen(Listener listener) { listener_ = std::move(listener); }

  Tick tick() const { return tick_; }
  std::uint64_t rounds() const { return rounds_; }  // of messages so far, of all partitions
  WorldHash hash() const;
  WorldHash program_hash() const;  // of programs alone

  // Sums over the partitions.
  TickCounts counts() const;

  // Of the last tick, ascending by (body, kind).
  std::vector<Divergence> divergences() const;

  // The state of a body, wherever it lives. NOT_FOUND for static and unknown ones.
  absl::StatusOr<BodyRecord> body(BodyId id) const;

  std::size_t size() const { return members_.size(); }
  TickMachine& machine(Rank rank) { return *members_[rank].machine; }
  Partition& partition(Rank rank) { return *members_[rank].partition; }

 private:
  PartitionCluster() = default;

  struct Member {
    std::unique_ptr<Engine> engine;
    std::unique_ptr<Partition> partition;
    std::unique_ptr<TickMachine> machine;
  };

  absl::StatusOr<Member*> add_member(const PartitionOptions& options);

  std::vector<Member> members_;
  Tick tick_ = 0;
  std::uint64_t rounds_ = 0;
  Listener listener_;
};

}  // namespace tessera
