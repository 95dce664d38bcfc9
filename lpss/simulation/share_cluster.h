// Several shares of one world in one process, their messages handed over directly: what a cluster computes,
// without the cluster. For tests and experiments.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <span>
#include <vector>

#include "lpss/simulation/simulation.h"
#include "lpss/tick/share.h"

namespace tessera {

class ShareCluster {
 public:
  // Errors as Simulation::create(). `lone_bodies_coast` as in Share::Options.
  static absl::StatusOr<std::unique_ptr<ShareCluster>> create(const WorldDescription& world,
                                                              std::uint32_t shares, int threads = 1,
                                                              bool lone_bodies_coast = true);

  void step(std::span<const Command> commands = {});

  Tick tick() const { return tick_; }
  WorldHash hash() const;

  // Sums over the shares.
  TickCounts counts() const;

  // The state of a body, wherever it lives. NOT_FOUND for static and unknown ones.
  absl::StatusOr<BodyRecord> body(BodyId id) const;

  std::size_t size() const { return shares_.size(); }
  Share& share(Rank rank) { return *shares_[rank]; }

 private:
  ShareCluster() = default;

  std::vector<std::unique_ptr<Engine>> engines_;
  std::vector<std::unique_ptr<Share>> shares_;
  Tick tick_ = 0;
};

}  // namespace tessera
