#include "lpss/engine/test_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "lpss/base/disjoint_sets.h"

namespace tessera::engine_tests {
namespace {

Shape single(Geometry geometry) { return {{{std::move(geometry), {}}}}; }

Pose at(double x, double y, double z) { return {{x, y, z}, Eigen::Quaterniond::Identity()}; }

ConvexHull prism() {
  ConvexHull hull;
  for (int i = 0; i < 6; ++i) {
    const double angle = i * std::numbers::pi / 3;
    for (double z : {-0.4, 0.4}) hull.points.emplace_back(0.5 * std::cos(angle), 0.5 * std::sin(angle), z);
  }
  return hull;
}

Shape table() {
  Shape shape;
  shape.parts.push_back({tessera::Box{{1, 1, 0.2}}, at(0, 0, 0.3)});
  for (double x : {-0.4, 0.4}) {
    for (double y : {-0.4, 0.4}) shape.parts.push_back({tessera::Box{{0.2, 0.2, 0.6}}, at(x, y, -0.1)});
  }
  return shape;
}

TriangleMesh flat_mesh() {
  TriangleMesh mesh;
  constexpr int kCells = 8;
  for (int j = 0; j <= kCells; ++j) {
    for (int i = 0; i <= kCells; ++i) mesh.vertices.emplace_back(i * 5 - 20, j * 5 - 20, 0);
  }
  for (std::uint32_t j = 0; j < kCells; ++j) {
    for (std::uint32_t i = 0; i < kCells; ++i) {
      const std::uint32_t k = j * (kCells + 1) + i;
      mesh.indices.insert(mesh.indices.end(), {k, k + 1, k + kCells + 2, k, k + kCells + 2, k + kCells + 1});
    }
  }
  return mesh;
}

HeightField field() {
  HeightField field{41, 41, {1, 1}, std::vector<double>(41 * 41, 0.5)};
  field.heights.back() = 3;
  return field;
}

Shape tiles() {
  Shape shape;
  for (int i = -4; i < 4; ++i) {
    for (int j = -4; j < 4; ++j)
      shape.parts.push_back({tessera::Box{{5, 5, 2}}, at(i * 5 + 2.5, j * 5 + 2.5, -1)});
  }
  return shape;
}

}  // namespace

Precision test_precision = Precision::kFloat32;

EngineSettings test_settings() {
  EngineSettings settings;
  settings.precision = test_precision;
  settings.sleep_after = 0;
  return settings;
}

std::unique_ptr<Engine> test_engine(const EngineSettings& settings) {
  absl::StatusOr<std::unique_ptr<Engine>> engine = load_engine(settings);
  EXPECT_TRUE(engine.ok()) << engine.status();
  if (!engine.ok()) std::abort();
  add_test_shapes(**engine);
  return *std::move(engine);
}

Shape test_shape(ShapeId id) {
  switch (id) {
    case kBoxShape:
      return single(tessera::Box{{1, 1, 1}});
    case kSphereShape:
      return single(Sphere{0.5});
    case kCylinderShape:
      return single(Cylinder{0.5, 1});
    case kCapsuleShape:
      return single(Capsule{0.3, 0.5});
    case kHullShape:
      return single(prism());
    case kEllipsoidShape:
      return single(Ellipsoid{{0.6, 0.5, 0.4}});
    case kDumbbellShape:
      return {{{tessera::Box{{0.6, 0.4, 0.4}}, at(0.3, 0, 0)}, {Sphere{0.3}, at(-0.3, 0, 0.1)}}};
    case kTableShape:
      return table();
    case kFloorShape:
      return single(tessera::Box{{100, 100, 2}});
    case kPlaneShape:
      return single(Plane{});
    case kMeshShape:
      return single(flat_mesh());
    case kHeightFieldShape:
      return single(field());
    case kLargeBoxShape:
      return single(tessera::Box{{6, 6, 6}});
    case kSmallBallShape:
      return single(Sphere{0.05});
    default:
      return tiles();
  }
}

void add_test_shapes(Engine& engine) {
  for (ShapeId id = 0; id <= kSmallBallShape; ++id) engine.add_shape(id, test_shape(id));
}

double resting_height(ShapeId id) {
  constexpr double kHeights[] = {0.5, 0.5, 0.5, 0.55, 0.4, 0.4, 0.2, 0.4};
  return kHeights[id];
}

BodyRecord dynamic_body(std::uint64_t id, ShapeId shape, const Eigen::Vector3d& position) {
  BodyRecord record;
  record.id = {id};
  record.properties.shape = shape;
  record.properties.inertia = {1.0 / 6, 1.0 / 6, 1.0 / 6};
  record.state.position = {position.x(), position.y(), position.z()};
  return record;
}

BodyRecord static_body(std::uint64_t id, ShapeId shape, const Eigen::Vector3d& position) {
  BodyRecord record = dynamic_body(id, shape, position);
  record.properties.motion = Motion::kStatic;
  record.state.activity = Activity::kAsleep;
  return record;
}

TestWorld::TestWorld(Engine& engine) : world_(engine.make_world()), solver_(engine.make_solver()) {}

BodySlot TestWorld::add(const BodyRecord& record, Role role) {
  const bool is_static = record.properties.motion == Motion::kStatic;
  const BodySlot slot = world_->add(record, is_static ? Role::kStatic : role);
  world_->set_gravity(slot, {0, 0, -9.81});
  records_[record.id.value] = record;
  slots_[record.id.value] = slot;
  return slot;
}

BodySlot TestWorld::add_static(std::uint64_t id, const Shape& part, const Pose& pose) {
  records_[id] = static_body(id, 0, pose.position);
  return slots_[id] = world_->add_static({id}, records_[id].properties, part, pose);
}

void TestWorld::remove(std::uint64_t id) {
  world_->remove(slots_.at(id));
  records_.erase(id);
  slots_.erase(id);
}

// Bullet's rule: an island sleeps when all its bodies want to, and wakes with any of them.
void TestWorld::settle_islands() {
  std::map<std::uint64_t, std::uint64_t> parent;
  const auto root = [&](std::uint64_t id) {
    while (parent[id] != id) id = parent[id];
    return id;
  };
  const auto is_dynamic = [&](BodyId id) {
    return records_.at(id.value).properties.motion == Motion::kDynamic;
  };
  for (const auto& [id, record] : records_) parent[id] = id;
  for (const ContactPair& pair : world_->contacts()) {
    if (is_dynamic(pair.a) && is_dynamic(pair.b)) parent[root(pair.b.value)] = root(pair.a.value);
  }
  std::map<std::uint64_t, bool> is_awake;
  for (const auto& [id, slot] : slots_) {
    if (is_dynamic({id}))
      is_awake[root(id)] = is_awake[root(id)] || world_->activity(slot) == Activity::kAwake;
  }
  for (const auto& [id, slot] : slots_) {
    if (!is_dynamic({id})) continue;
    const bool sleeps = world_->activity(slot) == Activity::kAsleep;
    if (is_awake[root(id)] && sleeps) world_->wake(slot);
    if (!is_awake[root(id)] && !sleeps) world_->sleep(slot);
  }
}

void TestWorld::step(double dt) {
  world_->detect(dt);
  settle_islands();
  SolveTask task;
  const auto is_solved = [&](std::uint64_t id) {
    return records_.at(id).properties.motion == Motion::kDynamic &&
           world_->activity(slots_.at(id)) != Activity::kAsleep;
  };
  for (const auto& [id, slot] : slots_) {
    if (is_solved(id)) task.bodies.push_back({world_.get(), slot});
  }
  const std::span<const ContactPair> contacts = world_->contacts();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (is_solved(contacts[i].a.value) || is_solved(contacts[i].b.value))
      task.contacts.push_back({world_.get(), static_cast<std::uint32_t>(i)});
  }
  divide_into_islands(task);
  SolvedTask solved;
  solver_->solve(task, dt, solved);
  world_->integrate(dt);
}

std::size_t TestWorld::asleep() const {
  std::size_t count = 0;
  for (const auto& [id, record] : records_) {
    if (record.properties.motion != Motion::kStatic && state(id).activity == Activity::kAsleep) ++count;
  }
  return count;
}

std::uint64_t TestWorld::hash() const {
  std::uint64_t hash = 14695981039346656037u;
  for (const auto& [id, record] : records_) {
    if (record.properties.motion != Motion::kStatic) hash = hash_of(state(id), hash + id);
  }
  return hash;
}

TestWorld TestWorld::rebuilt(Engine& engine, std::uint64_t seed) const {
  TestWorld fresh(engine);
  std::mt19937_64 random(seed);
  std::vector<BodyRecord> records;
  for (const auto& [id, record] : records_) {
    records.push_back(record);
    records.back().state = state(id);
  }
  std::shuffle(records.begin(), records.end(), random);
  for (const BodyRecord& record : records) fresh.add(record);

  std::vector<ManifoldState> manifolds;
  for (std::size_t i = 0; i < world_->contacts().size(); ++i) manifolds.push_back(world_->export_manifold(i));
  std::shuffle(manifolds.begin(), manifolds.end(), random);
  for (const ManifoldState& manifold : manifolds) fresh.world_->import_manifold(manifold);
  return fresh;
}

void divide_into_islands(SolveTask& task, const std::vector<CloneOf>& clones) {
  std::map<std::pair<SectorWorld*, BodySlot>, std::size_t> places;
  for (std::size_t n = 0; n < task.bodies.size(); ++n)
    places[{task.bodies[n].world, task.bodies[n].slot}] = n;
  for (const CloneOf& clone : clones) places[{clone.clone.world, clone.clone.slot}] = clone.body;
  DisjointSets sets(task.bodies.size());
  std::map<JointId, std::size_t> children;
  for (const IslandJoint& joint : task.joints) children[joint.id] = joint.child;
  for (const IslandJoint& joint : task.joints) {
    if (joint.has_parent()) sets.unite(joint.child, joint.parent);
    for (const JointAxis& axis : axes_of(*joint.form)) {
      if (axis.mimic.is_set() && children.contains(axis.mimic.leader))
        sets.unite(joint.child, children.at(axis.mimic.leader));
    }
  }
  std::vector<std::size_t> of_contact;  // a body that it pushes
  for (WorldPair& contact : task.contacts) {
    const ContactPair& pair = contact.world->contacts()[contact.pair];
    const auto a = places.find({contact.world, pair.slot_a});
    const auto b = places.find({contact.world, pair.slot_b});
    if (a != places.end()) contact.a = static_cast<std::uint32_t>(a->second);
    if (b != places.end()) contact.b = static_cast<std::uint32_t>(b->second);
    if (a != places.end() && b != places.end()) sets.unite(a->second, b->second);
    of_contact.push_back(std::min(contact.a, contact.b));
  }
  SolveTask divided;
  std::vector<std::size_t> moved(task.bodies.size());
  for (std::size_t first = 0; first < task.bodies.size(); ++first) {
    if (sets.find(first) != first) continue;
    IslandEnd end;
    for (std::size_t n = 0; n < task.bodies.size(); ++n) {
      if (sets.find(n) != first) continue;
      moved[n] = divided.bodies.size();
      divided.bodies.push_back(task.bodies[n]);
    }
    for (std::size_t n = 0; n < task.contacts.size(); ++n) {
      if (sets.find(of_contact[n]) != first) continue;
      WorldPair contact = task.contacts[n];
      end.substeps = std::max<int>(end.substeps, contact.world->contacts()[contact.pair].substeps);
      for (std::uint32_t* place : {&contact.a, &contact.b}) {
        if (*place != WorldPair::kFixed) *place = static_cast<std::uint32_t>(moved[*place]);
      }
      divided.contacts.push_back(contact);
    }
    for (IslandJoint joint : task.joints) {
      if (sets.find(joint.child) != first) continue;
      joint.child = moved[joint.child];
      if (joint.has_parent()) joint.parent = moved[joint.parent];
      divided.joints.push_back(joint);
    }
    end.bodies = divided.bodies.size();
    end.contacts = divided.contacts.size();
    end.joints = divided.joints.size();
    divided.islands.push_back(end);
  }
  task = std::move(divided);
}

std::uint64_t hash_of(const BodyState& state, std::uint64_t seed) {
  std::uint64_t hash = seed;
  const auto mix = [&](double value) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211u;
  };
  for (double v : state.position) mix(v);
  for (double v : state.rotation) mix(v);
  for (double v : state.linear_velocity) mix(v);
  for (double v : state.angular_velocity) mix(v);
  mix(state.still_for);
  mix(static_cast<double>(state.activity));
  return hash;
}

}  // namespace tessera::engine_tests
