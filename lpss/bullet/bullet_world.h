// One sector's world in Bullet.
//
// Bullet's own stepSimulation() and dynamics world are not used: forces, prediction, sweeps, integration and
// sleeping are our own loops, so that nothing in them depends on the order in which bodies were added. The
// bits do not depend on history because:
//   * The unique id of a body's broadphase proxy is its BodyId, so the two sides of a pair are always the
//     same.
//   * A pair is detected while the tight boxes of its bodies overlap, and loses its points when they do not.
//     Bullet's broadphase alone would keep a pair while its padded boxes overlap, which depend on history.
//   * The boxes are functions of the bodies' states: pose and prediction at detect(), pose alone for bodies
//     that are asleep or were just set.
//   * Compounds have our own algorithm (compound_algorithm.h).
//   * Sweeps and rays test bodies in the order of their ids, and sweeps see all others unmoved.
//   * Manifolds are returned sorted.
//
// A body whose state is not finite, or whose box is larger than 1000 km, is removed by Bullet's broadphase:
// it is reported as asleep and no longer moved, and must be detected by its state.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "lpss/bullet/bullet_body.h"
#include "lpss/bullet/bullet_engine.h"
#include "lpss/bullet/collision_space.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

class BulletWorld final : public SectorWorld {
 public:
  explicit BulletWorld(BulletEngine& engine);
  ~BulletWorld() override;

  // Bodies: bullet_world.cc.
  BodySlot add(const BodyRecord& record, Role role) override;
  BodySlot add_static(BodyId id, const BodyProperties& properties, const Shape& part,
                      const Pose& pose) override;
  void remove(BodySlot slot) override;
  BodyState state(BodySlot slot) const override { return body(slot).state(); }
  void set_state(BodySlot slot, const BodyState& state) override;
  Eigen::Vector3d position(BodySlot slot) const override;
  Eigen::Vector3d linear_velocity(BodySlot slot) const override;
  Activity activity(BodySlot slot) const override { return body(slot).activity(); }
  void set_velocity(BodySlot slot, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) override;
  void set_surface(BodySlot, const Surface&) override {}  // Bullet knows one coefficient of friction alone
  void apply_impulse(BodySlot slot, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever) override;
  void add_wrench(BodySlot slot, const Wrench& wrench) override;
  void set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) override;
  void rest() override {}
  void set_range(BodySlot, Range) override {}  // the policy clone detects all there is
  void set_jointed(BodySlot slot, bool jointed) override { body(slot).jointed = jointed; }
  void sleep(BodySlot slot) override;
  void wake(BodySlot slot) override;
  Wrench total_wrench(BodySlot slot) const override;
  void set_total_wrench(BodySlot slot, const Wrench& wrench) override;

  // The step: bullet_step.cc.
  void detect(double dt, const ParallelFor& parallel) override;
  void fly(BodySlot slot, double dt) override;
  // Orbits are as Bullet has them: a kick and a drift, of first order.
  bool flew(BodySlot) const override { return false; }
  void end_flight(BodySlot, const Eigen::Vector3d&, double) override {}
  std::vector<StoppedBody> integrate(double dt, const ParallelFor& parallel) override;

  // Contacts: bullet_contacts.cc.
  std::span<const ContactPair> contacts() override;
  std::vector<ContactDetail> touching_patches(std::size_t pair) const override;
  ManifoldState export_manifold(std::size_t pair) const override;
  void import_manifold(const ManifoldState& state) override;
  void append_numbers(BodySlot slot, std::string& bytes) const override;
  void append_pair_numbers(std::size_t pair, std::string& bytes) const override;
  bool take_solved(BodySlot, std::string_view&) override { return false; }
  bool take_solved_pair(std::size_t, std::string_view&) override { return false; }

  // Boxes, sweeps and rays: bullet_queries.cc.
  Eigen::AlignedBox3d swept_box(BodySlot slot, double dt) const override;
  void append_outside(const Eigen::AlignedBox3d& inside, double dt, std::vector<BodyOutside>& outside,
                      const ParallelFor& parallel) const override;
  bool reaches_home_body(const Eigen::AlignedBox3d& bounds, BodySlot& hint) const override;
  std::optional<RayHit> raycast(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                const QueryFilter& filter) const override;
  std::vector<RayHit> raycast_all(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                  const QueryFilter& filter) const override;
  std::vector<NearBody> near(const Geometry& probe, const Pose& pose, double reach,
                             const QueryFilter& filter) const override;
  // By Bullet's own cast.
  std::optional<ProbeHit> sweep(const Geometry& probe, const Pose& pose, const Eigen::Vector3d& direction,
                                double length, const QueryFilter& filter) const override;

  // For the solver: a body of this world, and the manifolds of a pair of contacts().
  Body& body(BodySlot slot) { return *bodies_[static_cast<std::size_t>(slot)]; }
  const Body& body(BodySlot slot) const { return *bodies_[static_cast<std::size_t>(slot)]; }
  std::span<btPersistentManifold* const> manifolds_of(std::size_t pair) const;

 private:
  struct SweepHit {
    Body* other = nullptr;
    btScalar fraction = 1;
    btVector3 normal;
  };

  struct PairRange {
    std::size_t first = 0;
    std::size_t count = 0;
  };

  BodySlot add(std::unique_ptr<Body> body);
  void predict(double dt);
  void set_bounds_to_predictions();
  void make_predictive_contacts();
  void make_predictive_contact(Body& body, const SweepHit& hit, const btVector3& motion);
  void keep_still_clock(Body& body, double dt);
  void release(std::vector<btPersistentManifold*>& manifolds);
  void release_of(const Body& body, std::vector<btPersistentManifold*>& manifolds);
  void gather();
  bool is_wanted(const Body& a, const Body& b) const;
  CollisionSpace& space() const;
  void leave_space();
  Bounds bounds_of(const Body& body) const;
  void set_bounds(const Body& body, const Bounds& bounds) const;
  void set_bounds_to_pose(const Body& body) const;
  void set_bounds_to_poses() const;
  std::optional<SweepHit> sweep(Body& body, const btTransform& to) const;
  // What queries may meet on a ray or in a box, by id.
  std::vector<Body*> bodies_along(const btVector3& from, const btVector3& to,
                                  const QueryFilter& filter) const;
  std::vector<Body*> bodies_in(const btVector3& low, const btVector3& high, const QueryFilter& filter) const;

  BulletEngine& engine_;
  const EngineSettings& settings_;
  mutable std::unique_ptr<CollisionSpace> space_;  // while there are two bodies, or after a query
  mutable Bounds lone_bounds_;                     // of the only body, without a space

  std::vector<std::unique_ptr<Body>> bodies_;  // by slot; null where free
  std::vector<BodySlot> free_slots_;
  std::unordered_map<std::uint64_t, BodySlot> slots_;  // by body id

  std::vector<btPersistentManifold*> predictive_;  // of sweeps, until the next detection
  bool is_gathered_ = true;
  std::vector<ContactPair> pairs_;
  std::vector<PairRange> ranges_;                 // of pairs_, in manifolds_
  std::vector<btPersistentManifold*> manifolds_;  // sorted

  mutable bool bounds_are_old_ = false;  // bodies moved since their boxes were made
};

// The Bullet body of a task's body.
inline Body& body_of(const WorldBody& body) { return static_cast<BulletWorld*>(body.world)->body(body.slot); }
inline btRigidBody& rigid_of(const WorldBody& body) { return body_of(body).rigid; }

}  // namespace tessera::bullet
