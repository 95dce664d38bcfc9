#include "lpss/simulation/plain_world.h"

#include <algorithm>

#include "lpss/base/disjoint_sets.h"
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
  plain->world_ = plain->engine_->make_world();
  plain->solver_ = plain->engine_->make_solver();
  for (BodyRecord& record : *records) {
    Eigen::Map<Eigen::Vector3d> position(record.state.position.data());
    position += metres_between(world.anchor, record.home, world.settings.sector_size);
    record.home = world.anchor;
    const bool fixed = record.properties.motion == Motion::kStatic;
    const BodySlot slot = plain->world_->add(record, fixed ? Role::kStatic : Role::kHome);
    if (fixed) continue;
    if (record.properties.motion == Motion::kDynamic) plain->places_[record.id] = plain->bodies_.size();
    plain->bodies_.push_back({record, slot});
  }
  plain->add_joints(*joints, *records);
  return plain;
}

void PlainWorld::add_joints(const std::vector<JointRecord>& joints, const std::vector<BodyRecord>& records) {
  joints_.reserve(joints.size());
  for (const JointRecord& record : joints) {
    if (!is_bullets(record)) continue;
    Joint& joint = joints_.emplace_back(Joint{record, {}});
    const JointProperties& properties = joint.record.properties;
    const auto of_world = [&](BodyId id) {
      const BodySlot slot = bodies_[places_.at(id)].slot;
      world_->set_jointed(slot, true);
      return WorldBody{world_.get(), slot};
    };
    TaskJoint& task = joint.task;
    task.id = record.id;
    task.properties = &properties;
    task.drives = &joint.record.drives;
    task.child = of_world(properties.child);
    if (record.parent_motion == Motion::kDynamic) {
      task.parent = of_world(properties.parent);
    } else if (properties.parent.value != 0) {
      const BodyState& parent = records[properties.parent.value - 1].state;
      task.fixed_parent =
          Pose{Eigen::Vector3d(parent.position.data()), quaternion_of(parent)} * properties.in_parent;
    } else {
      task.fixed_parent = properties.in_parent;
      task.fixed_parent.position += metres_between(anchor_, properties.anchor, settings_.sector_size);
    }
    if (!properties.bodies_collide && properties.parent.value != 0)
      engine_->set_apart(properties.parent, properties.child, true);
  }
}

void PlainWorld::set_drives(JointId id, const JointDrives& drives) {
  for (Joint& joint : joints_) {
    if (joint.record.id != id) continue;
    joint.record.drives = drives;
    world_->wake(joint.task.child.slot);
  }
}

void PlainWorld::set_gravity() {
  for (const Body& body : bodies_) {
    if (!body.record.properties.gravity) continue;
    world_->set_gravity(body.slot, acceleration_at(settings_.gravity, anchor_, world_->position(body.slot),
                                                   settings_.sector_size));
  }
}

// Bodies that touch, or that joints connect, sleep and wake together, as everywhere in Tessera; what is awake
// goes to the solver.
void PlainWorld::settle_islands(SolveTask& task) {
  DisjointSets sets(bodies_.size());
  const std::span<const ContactPair> pairs = world_->contacts();
  for (const ContactPair& pair : pairs) {
    const auto a = places_.find(pair.a);
    const auto b = places_.find(pair.b);
    if (a != places_.end() && b != places_.end()) sets.unite(a->second, b->second);
  }
  for (const Joint& joint : joints_) {
    if (joint.task.parent.world == nullptr) continue;
    const JointProperties& properties = joint.record.properties;
    sets.unite(places_.at(properties.parent), places_.at(properties.child));
  }
  std::vector<char> awake(bodies_.size(), 0);
  std::vector<char> restless(bodies_.size(), 0);
  for (const auto& [id, place] : places_) {
    const Activity activity = world_->activity(bodies_[place].slot);
    if (activity != Activity::kAsleep) awake[sets.find(place)] = 1;
    if (activity == Activity::kAwake) restless[sets.find(place)] = 1;
  }
  for (std::size_t place = 0; place < bodies_.size(); ++place) {
    const Body& body = bodies_[place];
    const std::size_t island = sets.find(place);
    if (!places_.contains(body.record.id) || !awake[island]) continue;
    const Activity activity = world_->activity(body.slot);
    if (!restless[island]) {
      if (activity != Activity::kAsleep) world_->sleep(body.slot);
      continue;
    }
    if (activity == Activity::kAsleep) world_->wake(body.slot);
    task.bodies.push_back({world_.get(), body.slot});
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto a = places_.find(pairs[i].a);
    const auto b = places_.find(pairs[i].b);
    if (a == places_.end() && b == places_.end()) continue;
    if (restless[sets.find(a != places_.end() ? a->second : b->second)])
      task.contacts.push_back({world_.get(), i});
  }
  for (const Joint& joint : joints_) {
    if (restless[sets.find(places_.at(joint.record.properties.child))]) task.joints.push_back(joint.task);
  }
}

void PlainWorld::step() {
  set_gravity();
  world_->detect(settings_.time_step);
  SolveTask task;
  settle_islands(task);
  if (!task.bodies.empty()) solver_->solve(task, settings_.time_step);
  world_->integrate(settings_.time_step);
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
