#include "lpss/engine/joint_scene.h"

#include <cmath>

namespace tessera::engine_tests {
namespace {

Eigen::Vector3d centre_of(int sector) { return {sector * kSectorSize, 0, 0}; }

BodyState shifted(BodyState state, double x) {
  state.position[0] += x;
  return state;
}

Pose pose_of(const BodyState& state) {
  return {Eigen::Map<const Eigen::Vector3d>(state.position.data()), quaternion_of(state)};
}

}  // namespace

JointScene::JointScene(Engine& engine, int sectors) : solver_(engine.make_solver()) {
  for (int s = 0; s < sectors; ++s) worlds_.push_back(engine.make_world());
}

void JointScene::add(const BodyRecord& record, int sector, const Eigen::Vector3d& gravity) {
  BodyRecord local = record;
  local.state = shifted(record.state, -centre_of(sector).x());
  const Motion motion = record.properties.motion;
  SectorWorld& world = *worlds_[static_cast<std::size_t>(sector)];
  const BodySlot slot = world.add(local, motion == Motion::kStatic ? Role::kStatic : Role::kHome);
  world.set_gravity(slot, gravity);
  homes_[record.id.value] = {sector, slot, motion};
}

std::size_t JointScene::tie(JointType type, std::uint64_t parent, std::uint64_t child, const Pose& frame) {
  Tied tied;
  tied.properties.type = type;
  tied.properties.parent = {parent};
  tied.properties.child = {child};
  tied.properties.in_parent = parent == 0 ? frame : side({parent}).pose.inverse() * frame;
  tied.properties.in_child = side({child}).pose.inverse() * frame;
  tied.fixed_parent = frame;
  for (const std::uint64_t id : {parent, child}) {
    if (id != 0)
      worlds_[static_cast<std::size_t>(homes_.at(id).sector)]->set_jointed(homes_.at(id).slot, true);
  }
  joints_.push_back(tied);
  return joints_.size() - 1;
}

JointState JointScene::joint_state(std::size_t n) const {
  const JointProperties& joint = joints_[n].properties;
  return tessera::joint_state(joint, side(joint.parent), side(joint.child));
}

WorldBody JointScene::place(BodyId id) const {
  const Home& home = homes_.at(id.value);
  return {worlds_[static_cast<std::size_t>(home.sector)].get(), home.slot};
}

JointSide JointScene::side(BodyId id) const {
  if (id.value == 0) return {};
  const BodyState at = state(id.value);
  return {pose_of(at), Eigen::Map<const Eigen::Vector3d>(at.linear_velocity.data()),
          Eigen::Map<const Eigen::Vector3d>(at.angular_velocity.data())};
}

IslandJoint JointScene::island_joint(const Tied& tied,
                                     const std::map<std::uint64_t, std::size_t>& places) const {
  IslandJoint joint;
  joint.form = &tied.properties;
  joint.drives = &tied.drives;
  joint.child = places.at(tied.properties.child.value);
  const Eigen::Vector3d origin = centre_of(homes_.at(tied.properties.child.value).sector);
  if (const auto parent = places.find(tied.properties.parent.value); parent != places.end()) {
    joint.parent = parent->second;
    joint.parent_origin = centre_of(homes_.at(tied.properties.parent.value).sector) - origin;
    return joint;
  }
  if (tied.properties.parent.value != 0) {
    joint.fix_parent(side(tied.properties.parent), -origin);
    return joint;
  }
  joint.fixed_parent = tied.fixed_parent;
  joint.fixed_parent.position -= origin;
  return joint;
}

void JointScene::step(IslandSolver& solver) {
  for (const auto& world : worlds_) world->detect(dt_);
  SolveTask task;
  std::map<std::uint64_t, std::size_t> places;
  for (const auto& [id, home] : homes_) {
    if (home.motion != Motion::kDynamic) continue;
    places[id] = task.bodies.size();
    task.bodies.push_back(place({id}));
  }
  for (const auto& world : worlds_) {
    for (std::uint32_t k = 0; k < world->contacts().size(); ++k) task.contacts.push_back({world.get(), k});
  }
  for (const Tied& tied : joints_) {
    task.joints.push_back(island_joint(tied, places));
    task.joints.back().id = JointId{task.joints.size()};
  }
  divide_into_islands(task);
  SolvedTask solved;
  solver.solve(task, dt_, solved);
  for (const auto& world : worlds_) world->integrate(dt_);
}

void JointScene::run(double seconds) {
  for (int tick = 0; tick < std::lround(seconds / dt_); ++tick) step();
}

BodyState JointScene::state(std::uint64_t id) const {
  const Home& home = homes_.at(id);
  return shifted(worlds_[static_cast<std::size_t>(home.sector)]->state(home.slot),
                 centre_of(home.sector).x());
}

void JointScene::set_state(std::uint64_t id, const BodyState& state) {
  const Home& home = homes_.at(id);
  worlds_[static_cast<std::size_t>(home.sector)]->set_state(home.slot,
                                                            shifted(state, -centre_of(home.sector).x()));
}

std::uint64_t JointScene::hash() const {
  std::uint64_t hash = 1;
  for (const auto& [id, home] : homes_) hash = hash_of(state(id), hash);
  return hash;
}

BodyRecord ghost(std::uint64_t id, const Eigen::Vector3d& position) {
  BodyRecord record = dynamic_body(id, kBoxShape, position);
  record.properties.category = 0;
  record.properties.mask = 0;
  return record;
}

Pose frame_at(const Eigen::Vector3d& position, const Eigen::Vector3d& axis) {
  return {position, Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), axis)};
}

}  // namespace tessera::engine_tests
