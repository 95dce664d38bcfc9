#include "lpss/simulation/simulation.h"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "lpss/engine/load_engine.h"
#include "lpss/model/validate.h"
#include "lpss/observe/state.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/tick/events.h"

namespace tessera {

absl::StatusOr<BodyRecord> record_of(const BodyDescription& body, const WorldSettings& settings) {
  BodyRecord record;
  record.properties = body.properties;
  if (record.properties.motion == Motion::kStatic) {
    // Nothing is ever integrated: the centre frame is the body frame.
    record.properties.centre = {};
    record.properties.principal_axes = {0, 0, 0, 1};
  }
  const absl::StatusOr<WorldPose> centre =
      compose(body.pose, centre_frame(record.properties), settings.sector_size);
  if (!centre.ok()) {
    return absl::Status(centre.status().code(),
                        absl::StrCat("body \"", body.name, "\": ", centre.status().message()));
  }
  record.home = centre->position.sector;
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = centre->position.local;
  record.state.rotation = rotation_of(centre->orientation);
  Eigen::Map<Eigen::Vector3d>(record.state.linear_velocity.data()) = body.linear_velocity;
  Eigen::Map<Eigen::Vector3d>(record.state.angular_velocity.data()) = body.angular_velocity;
  return record;
}

absl::StatusOr<std::vector<BodyRecord>> records_of(const WorldDescription& world) {
  if (absl::Status status = validate(world); !status.ok()) return status;
  std::vector<BodyRecord> records;
  records.reserve(world.bodies.size());
  for (const BodyDescription& body : world.bodies) {
    absl::StatusOr<BodyRecord> record = record_of(body, world.settings);
    if (!record.ok()) return record.status();
    record->id = BodyId{records.size() + 1};
    records.push_back(*record);
  }
  return records;
}

WorldPose body_pose(const SectorIndex& home, const BodyState& state, const Pose& centre_frame,
                    double sector_size) {
  const WorldPose centre{{home, Eigen::Vector3d(state.position.data())}, quaternion_of(state)};
  const absl::StatusOr<WorldPose> pose = compose(centre, centre_frame.inverse(), sector_size);
  return pose.ok() ? *pose : centre;
}

WorldPose body_pose(const BodyRecord& record, double sector_size) {
  return body_pose(record.home, record.state, centre_frame(record.properties), sector_size);
}

SectorMap placed(const WorldDescription& world, std::span<const BodyRecord> records, std::uint32_t servers,
                 std::uint64_t epoch) {
  absl::flat_hash_map<SectorIndex, double> weights;
  for (const BodyRecord& record : records) {
    if (record.properties.motion != Motion::kStatic) weights[record.home] += 1;
  }
  return SectorMap::balanced(world.anchor, {weights.begin(), weights.end()}, servers, epoch);
}

void add_world(Partition& partition, const WorldDescription& world, std::span<const BodyRecord> records,
               std::span<const JointRecord> joints) {
  for (std::size_t id = 0; id < world.shapes.size(); ++id) {
    add_shape(partition, id, std::make_shared<const Shape>(world.shapes[id]));
  }
  for (const BodyRecord& record : records) add_body(partition, record);
  add_joints(partition, joints);
}

double largest_radius(const WorldDescription& world) {
  double largest = 0;
  for (const BodyDescription& body : world.bodies) {
    if (body.properties.motion == Motion::kStatic) continue;
    largest = std::max(largest, bounding_radius(world.shapes.at(body.properties.shape),
                                                Eigen::Vector3d(body.properties.centre.data())));
  }
  return largest;
}

absl::StatusOr<std::unique_ptr<Simulation>> Simulation::make(const WorldSettings& settings,
                                                             const SectorIndex& anchor) {
  absl::StatusOr<std::unique_ptr<Engine>> engine = load_engine(engine_settings(settings));
  if (!engine.ok()) return engine.status();
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

void Simulation::for_each_body(const std::function<void(const BodyRecord&)>& visit) const {
  tessera::for_each_body(*partition_, visit);
}

void Simulation::report_contacts(bool on) { tessera::report_contacts(*partition_, on); }

}  // namespace tessera
