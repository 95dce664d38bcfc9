#include "cli/measure/local_world.h"

#include <algorithm>
#include <utility>

#include "lpss/observe/state.h"
#include "lpss/simulation/partition_cluster.h"
#include "lpss/simulation/plain_world.h"
#include "lpss/tick/events.h"

namespace tessera {
namespace {

// One partition, one thread.
class Sectors : public LocalWorld {
 public:
  explicit Sectors(std::unique_ptr<PartitionCluster> cluster) : cluster_(std::move(cluster)) {}

  void step() override { cluster_->step(); }
  double step_for_overlap() override {
    report_contacts(cluster_->partition(0), true);
    step();
    double deepest = 0;
    for (const ContactEvent& event : cluster_->machine(0).contact_events()) {
      deepest = std::max(deepest, event.depth);
    }
    report_contacts(cluster_->partition(0), false);
    return deepest;
  }
  std::vector<BodyRecord> bodies() const override {
    std::vector<BodyRecord> records;
    for_each_body(cluster_->partition(0), [&](const BodyRecord& record) { records.push_back(record); });
    return records;
  }
  WorldHash hash() const override { return cluster_->hash(); }

 private:
  std::unique_ptr<PartitionCluster> cluster_;
};

class OneWorld : public LocalWorld {
 public:
  explicit OneWorld(std::unique_ptr<PlainWorld> world) : world_(std::move(world)) {}

  void step() override { world_->step(); }
  double step_for_overlap() override {
    step();
    return 0;
  }
  std::vector<BodyRecord> bodies() const override {
    std::vector<BodyRecord> records;
    world_->for_each_body([&](const BodyRecord& record) { records.push_back(record); });
    return records;
  }
  WorldHash hash() const override { return world_->hash(); }

 private:
  std::unique_ptr<PlainWorld> world_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<LocalWorld>> in_sectors(const WorldDescription& world, bool free_flight) {
  absl::StatusOr<std::unique_ptr<PartitionCluster>> cluster =
      PartitionCluster::create(world, /*partitions=*/1, /*threads=*/1, free_flight);
  if (!cluster.ok()) return cluster.status();
  return std::make_unique<Sectors>(*std::move(cluster));
}

absl::StatusOr<std::unique_ptr<LocalWorld>> in_one_world(const WorldDescription& world) {
  absl::StatusOr<std::unique_ptr<PlainWorld>> plain = PlainWorld::create(world, world.settings.precision);
  if (!plain.ok()) return plain.status();
  return std::make_unique<OneWorld>(*std::move(plain));
}

}  // namespace tessera
