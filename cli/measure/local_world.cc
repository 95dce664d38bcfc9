#include "cli/measure/local_world.h"

#include <algorithm>
#include <utility>

#include "lpss/simulation/plain_world.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

template <typename World>
std::vector<BodyRecord> bodies_of(const World& world) {
  std::vector<BodyRecord> records;
  world.for_each_body([&](const BodyRecord& record) { records.push_back(record); });
  return records;
}

class Sectors : public LocalWorld {
 public:
  explicit Sectors(std::unique_ptr<Simulation> simulation) : simulation_(std::move(simulation)) {}

  void step() override { simulation_->step(); }
  double step_for_overlap() override {
    simulation_->report_contacts(true);
    step();
    double deepest = 0;
    for (const ContactEvent& event : simulation_->contact_events()) deepest = std::max(deepest, event.depth);
    simulation_->report_contacts(false);
    return deepest;
  }
  std::vector<BodyRecord> bodies() const override { return bodies_of(*simulation_); }
  WorldHash hash() const override { return simulation_->hash(); }

 private:
  std::unique_ptr<Simulation> simulation_;
};

class OneWorld : public LocalWorld {
 public:
  explicit OneWorld(std::unique_ptr<PlainWorld> world) : world_(std::move(world)) {}

  void step() override { world_->step(); }
  double step_for_overlap() override {
    step();
    return 0;
  }
  std::vector<BodyRecord> bodies() const override { return bodies_of(*world_); }
  WorldHash hash() const override { return world_->hash(); }

 private:
  std::unique_ptr<PlainWorld> world_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<LocalWorld>> in_sectors(const WorldDescription& world) {
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
  if (!simulation.ok()) return simulation.status();
  return std::make_unique<Sectors>(*std::move(simulation));
}

absl::StatusOr<std::unique_ptr<LocalWorld>> in_one_world(const WorldDescription& world) {
  absl::StatusOr<std::unique_ptr<PlainWorld>> plain = PlainWorld::create(world, world.settings.precision);
  if (!plain.ok()) return plain.status();
  return std::make_unique<OneWorld>(*std::move(plain));
}

}  // namespace tessera
