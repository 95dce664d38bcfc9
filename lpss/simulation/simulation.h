// A whole world in one process, without any network: the layer as an application embeds it.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/model/world_records.h"
#include "lpss/observe/world_hash.h"
#include "lpss/snapshot/world_snapshot.h"
#include "lpss/tick/tick_machine.h"

namespace tessera {

// Fills a new partition with a world: all shapes, static bodies and joints, and those of the other bodies
// that it hosts.
void add_world(Partition& partition, const WorldDescription& world, std::span<const BodyRecord> records,
               std::span<const JointRecord> joints);

// Runs a world in one partition. Not for several threads at a time.
class Simulation {
 public:
  // Validates and loads the world. `time` is asked where phases are to be timed (phase_times()).
  // Errors as validate(), and those of load_engine().
  static absl::StatusOr<std::unique_ptr<Simulation>> create(const WorldDescription& world, int threads = 1,
                                                            TimeSource time = {});

  // Goes on from a snapshot with the bits that its world would have had. Errors as validate(), restore() and
  // load_engine().
  static absl::StatusOr<std::unique_ptr<Simulation>> restore(const WorldSnapshot& world, int threads = 1,
                                                             TimeSource time = {});

  // All that goes on after this tick.
  WorldSnapshot snapshot() const;

  // A shape for bodies that commands spawn; its id must be new.
  void add_shape(ShapeId id, ShapeRef shape);
  void add_module(const std::shared_ptr<const ProgramModule>& module);  // that this process can run

  // One tick; the commands take effect at its beginning.
  void step(std::span<const Command> commands = {});

  Tick tick() const { return tick_; }
  WorldHash hash() const;
  WorldHash program_hash() const;  // of programs alone

  // Calls `visit` for each dynamic and kinematic body, in ascending order of ids.
  void for_each_body(const std::function<void(const BodyRecord&)>& visit) const;

  // Of the last tick.
  const TickCounts& counts() const { return machine_->counts(); }
  const PhaseTimes& phase_times() const { return machine_->phase_times(); }

  // Bodies that diverged in the last tick, ascending by (body, kind).
  const std::vector<Divergence>& divergences() const { return machine_->divergences(); }

  // Contact events of the last tick, ascending by (a, b); only gathered while switched on.
  void report_contacts(bool on);
  const std::vector<ContactEvent>& contact_events() const { return machine_->contact_events(); }

  // All of the world, for what lpss/observe offers.
  const Partition& partition() const { return *partition_; }

 private:
  Simulation() = default;
  static absl::StatusOr<std::unique_ptr<Simulation>> make(const WorldSettings& settings,
                                                          const SectorIndex& anchor);

  std::unique_ptr<Engine> engine_;
  std::unique_ptr<Partition> partition_;
  std::unique_ptr<TickMachine> machine_;
  Tick tick_ = 0;
};

}  // namespace tessera
