#include "cli/measure/local_world.h"

#include <algorithm>
#include <utility>
#include <variant>

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

  using LocalWorld::step;
  void step(std::span<const Command> commands) override { cluster_->step(commands); }
  std::vector<BodyRecord> bodies() const override {
    std::vector<BodyRecord> records;
    for_each_body(cluster_->partition(0), [&](const BodyRecord& record) { records.push_back(record); });
    return records;
  }
  void gather_contacts(bool gathers) override { report_contacts(cluster_->partition(0), gathers); }
  std::vector<ContactEvent> contacts() const override { return cluster_->machine(0).contact_events(); }
  std::size_t diverged() const override { return cluster_->counts().diverged; }
  WorldHash hash() const override { return cluster_->hash(); }

 private:
  std::unique_ptr<PartitionCluster> cluster_;
};

class OneWorld : public LocalWorld {
 public:
  explicit OneWorld(std::unique_ptr<PlainWorld> world) : world_(std::move(world)) {}

  using LocalWorld::step;
  void step(std::span<const Command> commands) override {
    for (const Command& command : commands) {
      if (const auto* drives = std::get_if<SetDrives>(&command))
        world_->set_drives(drives->id, drives->drives);
    }
    world_->step();
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

double LocalWorld::step_for_overlap() {
  gather_contacts(true);
  step();
  double deepest = 0;
  for (const ContactEvent& event : contacts()) deepest = std::max(deepest, event.depth);
  gather_contacts(false);
  return deepest;
}

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
