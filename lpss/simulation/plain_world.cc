#include "lpss/simulation/plain_world.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "lpss/engine/load_engine.h"
#include "lpss/model/gravity.h"
#include "lpss/partition/partition.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

bool is_bullets(const JointRecord& joint) {
  return joint.properties.type != JointType::kScrew && joint.parent_motion != Motion::kKinematic &&
         std::ranges::none_of(axes_of(joint.properties),
                              [](const JointAxis& axis) { return axis.mimic.is_set(); });
}

}  // namespace

absl::StatusOr<std::unique_ptr<PlainWorld>> PlainWorld::create(const WorldDescription& world,
                                                               Precision precision) {
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  if (!records.ok()) return records.status();
  const absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(world);
  if (!joints.ok()) return joints.status();
  EngineSettings settings = engine_settings(world.settings);
  settings.precision = precision;
  settings.plain_bullet = true;
  settings.fine_flight = false;
  absl::StatusOr<std::unique_ptr<Engine>> engine = load_engine(settings);
  if (!engine.ok()) return engine.status();

  std::unique_ptr<PlainWorld> plain(new PlainWorld());
  plain->settings_ = world.settings;
  plain->anchor_ = world.anchor;
  plain->engine_ = std::move(*engine);
  for (const Shape& shape : world.shapes) {
    if (std::ranges::any_of(shape.parts, [](const ShapePart& part) {
          return std::holds_alternative<Ground>(part.geometry);
        })) {
      return absl::InvalidArgumentError("ground of any extent: one world near one origin cannot have it");
    }
  }
  for (std::size_t i = 0; i < world.shapes.size(); ++i) {
    plain->engine_->add_shape(i, world.shapes[i]);
  }
  plain->world_ = plain->engine_->make_whole_world();
  std::vector<BodySlot> slots;
  for (BodyRecord& record : *records) {
    Eigen::Map<Eigen::Vector3d> position(record.state.position.data());
    position += metres_between(world.anchor, record.home, world.settings.sector_size);
    record.home = world.anchor;
    slots.push_back(plain->world_->add(record));
    if (record.properties.motion != Motion::kStatic) plain->bodies_.push_back({record, slots.back()});
  }
  for (const JointRecord& joint : *joints) plain->add_joint(joint, slots);
  return plain;
}

// `slots` of all bodies, whose ids count from 1.
void PlainWorld::add_joint(const JointRecord& record, const std::vector<BodySlot>& slots) {
  if (!is_bullets(record)) return;
  const JointProperties& properties = record.properties;
  const auto slot_of = [&](BodyId id) { return id.value == 0 ? kNoSlot : slots[id.value - 1]; };
  Joint joint{record, slot_of(properties.child), slot_of(properties.parent), properties.in_parent};
  if (joint.parent == kNoSlot)
    joint.in_parent.position += metres_between(anchor_, properties.anchor, settings_.sector_size);
  world_->set_joint(joint.record, joint.child, joint.parent, joint.in_parent);
  joints_.push_back(std::move(joint));
}

void PlainWorld::set_drives(JointId id, const JointDrives& drives) {
  for (Joint& joint : joints_) {
    if (joint.record.id != id) continue;
    joint.record.drives = drives;
    world_->set_joint(joint.record, joint.child, joint.parent, joint.in_parent);
  }
}

void PlainWorld::set_gravity() {
  for (const Body& body : bodies_) {
    const Eigen::Vector3d position(world_->state(body.slot).position.data());
    world_->set_gravity(body.slot,
                        acceleration_at(settings_.gravity, anchor_, position, settings_.sector_size));
  }
}

void PlainWorld::step() {
  if (!std::holds_alternative<UniformGravity>(settings_.gravity)) set_gravity();
  world_->step(settings_.time_step);
}

void PlainWorld::for_each_body(const std::function<void(const BodyRecord&)>& visit) const {
  for (const Body& body : bodies_) {
    BodyRecord record = body.record;
    record.state = world_->state(body.slot);
    visit(record);
  }
}

WorldHash PlainWorld::hash() const {
  WorldHash sum;
  for_each_body([&](const BodyRecord& record) { sum.add(record, anchor_); });
  return sum;
}

}  // namespace tessera
