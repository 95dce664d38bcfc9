#include "lpss/simulation/simulation.h"

#include "lpss/engine/load_engine.h"
#include "lpss/model/validate.h"
#include "lpss/observe/state.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/programs/module.h"
#include "lpss/programs/registry.h"
#include "lpss/tick/events.h"

namespace tessera {

void add_world(Partition& partition, const WorldDescription& world, std::span<const BodyRecord> records,
               std::span<const JointRecord> joints) {
  for (std::size_t id = 0; id < world.shapes.size(); ++id) {
    add_shape(partition, id, std::make_shared<const Shape>(world.shapes[id]));
  }
  for (const BodyRecord& record : records) add_body(partition, record);
  add_joints(partition, joints);
}

absl::StatusOr<std::unique_ptr<Simulation>> Simulation::make(const WorldSettings& settings,
                                                             const SectorIndex& anchor) {
  absl::StatusOr<std::unique_ptr<Engine>> engine = load_engine(engine_settings(settings));
  if (!engine.ok()) return engine.status();
  if (absl::Status status = can_run(settings.modules); !status.ok()) return status;
  std::unique_ptr<Simulation> simulation(new Simulation());
  simulation->engine_ = std::move(*engine);
  PartitionOptions options;
  options.settings = settings;
  options.anchor = anchor;
  options.map = SectorMap(anchor, {}, 1);
  simulation->partition_ = std::make_unique<Partition>(std::move(options), *simulation->engine_);
  return simulation;
}

absl::StatusOr<std::unique_ptr<Simulation>> Simulation::create(const WorldDescription& world, int threads,
                                                               TimeSource time) {
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  if (!records.ok()) return records.status();
  if (absl::Status status = check_programs(world); !status.ok()) return status;
  const absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(world);
  if (!joints.ok()) return joints.status();
  if (absl::Status status = open_grounds(world.shapes); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = make(world.settings, world.anchor);
  if (!simulation.ok()) return simulation.status();
  Partition& partition = *(*simulation)->partition_;
  add_world(partition, world, *records, *joints);
  (*simulation)->machine_ =
      std::make_unique<TickMachine>(partition, TickMachine::Options{parallel_on(threads), std::move(time)});
  return simulation;
}

absl::StatusOr<std::unique_ptr<Simulation>> Simulation::restore(const WorldSnapshot& world, int threads,
                                                                TimeSource time) {
  if (absl::Status status = validate(world); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = make(world.settings, world.anchor);
  if (!simulation.ok()) return simulation.status();
  Partition& partition = *(*simulation)->partition_;
  if (absl::Status status = resume(partition, world); !status.ok()) return status;
  (*simulation)->tick_ = world.tick;
  (*simulation)->machine_ = std::make_unique<TickMachine>(
      partition, TickMachine::Options{parallel_on(threads), std::move(time), world.tick});
  return simulation;
}

WorldSnapshot Simulation::snapshot() const {
  return {.settings = partition_->settings,
          .anchor = partition_->anchor,
          .tick = tick_,
          .shapes = shapes_of(*partition_),
          .shared = shared_state(*partition_),
          .sectors = pack_sectors(*partition_)};
}

void Simulation::add_module(const std::shared_ptr<const ProgramModule>& module) {
  tessera::add_module(*partition_, module);
}

void Simulation::add_shape(ShapeId id, ShapeRef shape) {
  tessera::add_shape(*partition_, id, std::move(shape));
}

void Simulation::step(std::span<const Command> commands) {
  ++tick_;
  for (std::optional<Round> round = machine_->begin_tick(commands); round;) {
    round = machine_->advance(std::move(round->to));
  }
}

WorldHash Simulation::hash() const { return hash_of(*partition_); }

WorldHash Simulation::program_hash() const { return program_hash_of(*partition_); }

void Simulation::for_each_body(const std::function<void(const BodyRecord&)>& visit) const {
  tessera::for_each_body(*partition_, visit);
}

void Simulation::report_contacts(bool on) { tessera::report_contacts(*partition_, on); }

}  // namespace tessera
