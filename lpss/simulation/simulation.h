// A whole world in one process, without any network: the layer as an application embeds it.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/model/world_description.h"
#include "lpss/observe/world_hash.h"
#include "lpss/simulation/world_snapshot.h"
#include "lpss/tick/tick_machine.h"

namespace tessera {

// The bodies of a description as records, in the order of their ids: the i-th body gets the id i + 1. Errors
// as validate(); nothing else can fail.
absl::StatusOr<std::vector<BodyRecord>> records_of(const WorldDescription& world);

// The record of one body that is described in the frame of a world; the id is left out. Errors as
// canonical().
absl::StatusOr<BodyRecord> record_of(const BodyDescription& body, const WorldSettings& settings);

// The joints of a description, whose bodies are valid, as records: the i-th joint gets the id i + 1. Errors
// as validate_joints().
absl::StatusOr<std::vector<JointRecord>> joint_records_of(const WorldDescription& world);

// A joint whose frames are given in body frames, with frames in centre frames, as it is simulated; `parent`
// is null where it is the world. OUT_OF_RANGE where its place in the world leaves the 64-bit range.
absl::StatusOr<JointProperties> joint_properties_of(const JointProperties& joint,
                                                    const BodyProperties* parent, const BodyProperties& child,
                                                    double sector_size);

// Where the body frame of a body is, for clients. Never fails for a body that lives in a world: a position
// that would leave the range stays in its home sector's frame.
WorldPose body_pose(const SectorIndex& home, const BodyState& state, const Pose& centre_frame,
                    double sector_size);
WorldPose body_pose(const BodyRecord& record, double sector_size);

// The first placement of a world: the curve cut so that each server gets about as many bodies that can move.
SectorMap placed(const WorldDescription& world, std::span<const BodyRecord> records, std::uint32_t servers,
                 std::uint64_t epoch);

// Fills a new partition with a world: all shapes, static bodies and joints, and those of the other bodies
// that it hosts.
void add_world(Partition& partition, const WorldDescription& world, std::span<const BodyRecord> records,
               std::span<const JointRecord> joints);

// The largest radius (m) around their centres of mass of the bodies that can move; 0 if there are none.
double largest_radius(const WorldDescription& world);

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

  // One tick; the commands take effect at its beginning.
  void step(std::span<const Command> commands = {});

  Tick tick() const { return tick_; }
  WorldHash hash() const;

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
