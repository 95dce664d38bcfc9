// One of the worlds that are stepped alternately.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/positions.h"
#include "cli/measure/stopwatch.h"
#include "cli/tune/trial.h"
#include "lpss/observe/state.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera {

class Contestant {
 public:
  // Errors as Simulation::create().
  static absl::StatusOr<Contestant> create(const WorldDescription& world, bool free_flight) {
    absl::StatusOr<std::unique_ptr<PartitionCluster>> cluster =
        PartitionCluster::create(world, /*partitions=*/1, /*threads=*/1, free_flight);
    if (!cluster.ok()) return cluster.status();
    return Contestant(*std::move(cluster), world);
  }

  void step() {
    const std::chrono::nanoseconds start = processor_time();
    cluster_->step();
    ticks_us_.push_back(microseconds(processor_time() - start));
  }

  // Processor time of the last `ticks` ticks.
  double spent_us(Tick ticks) const {
    return std::accumulate(ticks_us_.end() - static_cast<std::ptrdiff_t>(ticks), ticks_us_.end(), 0.0);
  }

  // Dynamic bodies, ascending by id.
  std::vector<BodyRecord> bodies() const {
    std::vector<BodyRecord> records;
    for_each_body(cluster_->partition(0), [&](const BodyRecord& record) {
      if (record.properties.motion == Motion::kDynamic) records.push_back(record);
    });
    return records;
  }
  // Of the same bodies; m, from the centre of the anchor's sector.
  Positions positions() const { return positions_from(origin_, bodies(), sector_size_); }

  // Sectors with a movable body.
  std::uint64_t sectors() const { return cluster_->counts().sectors; }
  std::string hash() const { return cluster_->hash().to_string(); }

 private:
  Contestant(std::unique_ptr<PartitionCluster> cluster, const WorldDescription& world)
      : cluster_(std::move(cluster)),
        origin_{world.anchor, Eigen::Vector3d::Zero()},
        sector_size_(world.settings.sector_size) {}

  std::unique_ptr<PartitionCluster> cluster_;
  WorldPosition origin_;
  double sector_size_;
  std::vector<double> ticks_us_;
};

}  // namespace tessera
