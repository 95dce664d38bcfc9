#include "lpss/bullet/small_step_solver.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <algorithm>
#include <utility>

#include "lpss/base/rotation.h"
#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"
#include "lpss/bullet/task_joint.h"

namespace tessera::bullet {
namespace {

// Points whose normals differ by less than some 18 degrees share friction.
constexpr btScalar kSameNormal = btScalar(0.95);

using Vector = ContactSolver<btScalar>::Vector;

Vector vector(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
btVector3 bt(const Vector& v) { return {v.x(), v.y(), v.z()}; }

// None for static bodies: they do not move, and a server that solves an island of others does not know where
// they are.
Vector lever(const btRigidBody& body, const btVector3& point) {
  if (body.isStaticObject()) return Vector::Zero();
  return vector(point - body.getWorldTransform().getOrigin());
}

// The friction of a patch is kept at its points, in equal parts.
Vector friction_of(const btManifoldPoint& point) {
  btVector3 p, q;
  btPlaneSpace1(point.m_normalWorldOnB, p, q);
  return vector(p * point.m_appliedImpulseLateral1 + q * point.m_appliedImpulseLateral2);
}

void keep_friction(btManifoldPoint& point, const btVector3& impulse, btScalar twist) {
  btVector3 p, q;
  btPlaneSpace1(point.m_normalWorldOnB, p, q);
  point.m_appliedImpulseLateral1 = impulse.dot(p);
  point.m_appliedImpulseLateral2 = impulse.dot(q);
  point.m_prevRHS = twist;
}

// A rotation vector in world axes applied to an orientation.
btMatrix3x3 turned(const btMatrix3x3& basis, const Vector& turn) {
  return to_bullet(Pose{{0, 0, 0}, rotation_by(turn.cast<double>())}).getBasis() * basis;
}

}  // namespace

SmallStepSolver::SmallStepSolver(const EngineSettings& settings)
    : settings_(settings),
      passes_(std::max(2, (settings.solver_iterations + settings.substeps - 1) / settings.substeps)),
      steps_(settings.substeps) {}

void SmallStepSolver::set_up(const SolveTask& task, double dt, int steps) {
  steps_ = steps;
  dt_ = dt;
  rigids_.clear();
  clones_.clear();
  bodies_.clear();
  kinematics_.clear();
  patches_.clear();
  points_.clear();
  joints_.clear();
  for (const WorldBody& body : task.bodies) {
    body_of(body).fine.reset();
    add_body(rigid_of(body));
  }
  for (const SolveTask::CloneOf& clone : task.clones) {
    clones_.push_back(&rigid_of(clone.clone));
    clones_.back()->setCompanionId(static_cast<int>(clone.original));
  }
  fixed_ = bodies_.size();
  bodies_.emplace_back();
  is_pushed_.assign(rigids_.size(), false);
  for (const WorldPair& contact : task.contacts) {
    for (btPersistentManifold* manifold :
         static_cast<BulletWorld*>(contact.world)->manifolds_of(contact.pair)) {
      add_manifold(*manifold);
    }
  }
  for (const TaskJoint& joint : task.joints) joints_.add(solved_joint(joint));
}

void SmallStepSolver::add_body(btRigidBody& rigid) {
  rigid.setCompanionId(static_cast<int>(rigids_.size()));
  rigids_.push_back(&rigid);
  const auto dt = btScalar(dt_);
  Contacts::Body& body = bodies_.emplace_back();
  body.linear = vector(rigid.getLinearVelocity());
  body.angular = vector(rigid.getAngularVelocity());
  body.linear_force = vector(rigid.getTotalForce() * rigid.getInvMass() * dt);
  body.angular_force = vector(rigid.getTotalTorque() * rigid.getInvInertiaTensorWorld() * dt +
                              rigid.computeGyroscopicImpulseImplicit_Body(dt));
  body.inverse_mass = rigid.getInvMass();
  for (int row = 0; row < 3; ++row)
    body.inverse_inertia.row(row) = vector(rigid.getInvInertiaTensorWorld()[row]);
}

void SmallStepSolver::round(int n) {
  if (n == 0) begin();
  const int number = n % (passes_ + 1);
  if (n > 0 && number == 0) contacts_.end_step();
  if (n + 1 == rounds()) {
    contacts_.rebound();
    return with_joints([&] { joints_.pass(); });
  }
  if (number == 0) {
    contacts_.start_step();
    return with_joints([&] { joints_.start_step(); });
  }
  const bool biased = number < passes_;
  if (!biased) {
    contacts_.advance();
    with_joints([&] { joints_.move(); });
  }
  contacts_.pass(biased);
  with_joints([&] { joints_.pass(); });
}

void SmallStepSolver::finish() {
  contacts_.end(patches_);
  find_corrections();
  write_impulses();
  write_bodies();
  for (btRigidBody* rigid : rigids_) rigid->setCompanionId(-1);
  for (btRigidBody* clone : clones_) clone->setCompanionId(-1);
}

std::size_t SmallStepSolver::place_of(const btRigidBody& rigid) {
  if (rigid.isStaticObject()) return fixed_;
  if (!rigid.isKinematicObject()) {
    // A clone that no task solves (its island is another server's) stands where it is.
    return rigid.getCompanionId() < 0 ? fixed_ : static_cast<std::size_t>(rigid.getCompanionId());
  }
  const auto [known, is_new] = kinematics_.try_emplace(&rigid, bodies_.size());
  if (is_new) {
    Contacts::Body& body = bodies_.emplace_back();
    body.linear = vector(rigid.getLinearVelocity());
    body.angular = vector(rigid.getAngularVelocity());
  }
  return known->second;
}

void SmallStepSolver::add_manifold(btPersistentManifold& manifold) {
  const auto& a = static_cast<const btRigidBody&>(*manifold.getBody0());
  const auto& b = static_cast<const btRigidBody&>(*manifold.getBody1());
  const std::size_t places[2] = {place_of(a), place_of(b)};
  const std::size_t first = patches_.size();
  for (int n = 0; n < manifold.getNumContacts(); ++n) {
    btManifoldPoint& point = manifold.getContactPoint(n);
    if (point.getDistance() > manifold.getContactProcessingThreshold()) continue;
    const Vector normal = vector(point.m_normalWorldOnB);
    auto patch =
        std::find_if(patches_.begin() + static_cast<std::ptrdiff_t>(first), patches_.end(),
                     [&](const Contacts::Patch& p) { return p.point[0].normal.dot(normal) > kSameNormal; });
    if (patch == patches_.end()) {
      patches_.emplace_back();
      points_.emplace_back();
      patch = patches_.end() - 1;
      patch->a = places[0];
      patch->b = places[1];
      patch->friction = point.m_combinedFriction;
      patch->restitution = point.m_combinedRestitution;
    }
    points_[static_cast<std::size_t>(patch - patches_.begin())].point[patch->points] = &point;
    Contacts::Point& row = patch->point[patch->points++];
    row.lever_a = lever(a, point.m_positionWorldOnA);
    row.lever_b = lever(b, point.m_positionWorldOnB);
    row.normal = normal;
    row.gap = point.getDistance();
    row.impulse = point.m_appliedImpulse;
    patch->friction_impulse += friction_of(point);
    patch->twist_impulse += point.m_prevRHS;
    for (const std::size_t place : places) {
      if (place < is_pushed_.size()) is_pushed_[place] = true;
    }
  }
}

void SmallStepSolver::begin() {
  jointed_.clear();
  for (const int place : joints_.bodies()) jointed_.push_back(static_cast<std::size_t>(place));
  std::sort(jointed_.begin(), jointed_.end());
  jointed_.erase(std::unique(jointed_.begin(), jointed_.end()), jointed_.end());
  const auto is_jointed = [&](std::size_t body) {
    return std::binary_search(jointed_.begin(), jointed_.end(), body);
  };
  for (Contacts::Patch& patch : patches_) patch.is_jointed = is_jointed(patch.a) || is_jointed(patch.b);
  contacts_.begin({.time_step = btScalar(dt_),
                   .steps = steps_,
                   .usual_steps = settings_.substeps,
                   .bounce_from = btContactSolverInfo().m_restitutionVelocityThreshold},
                  bodies_, patches_);
  begin_joints();
}

void SmallStepSolver::begin_joints() {
  if (joints_.is_empty()) return;
  linear_changes_.assign(rigids_.size(), btVector3(0, 0, 0));
  angular_changes_.assign(rigids_.size(), btVector3(0, 0, 0));
  std::vector<JointedBody> bodies(rigids_.size());
  for (const std::size_t place : jointed_) {
    is_pushed_[place] = true;
    const Contacts::Body& body = bodies_[place];
    bodies[place] = {body.inverse_mass,          body.inverse_inertia.cast<double>(),
                     body.linear.cast<double>(), body.angular.cast<double>(),
                     &linear_changes_[place],    &angular_changes_[place]};
  }
  joints_.set_up(bodies, dt_, steps_);
}

template <typename Act>
void SmallStepSolver::with_joints(Act act) {
  if (joints_.is_empty()) return;
  for (const std::size_t place : jointed_) {
    const Contacts::Motion change = contacts_.change(place);
    linear_changes_[place] = bt(change.linear);
    angular_changes_[place] = bt(change.angular);
  }
  act();
  for (const std::size_t place : jointed_)
    contacts_.set_change(place, {vector(linear_changes_[place]), vector(angular_changes_[place])});
}

void SmallStepSolver::find_corrections() {
  corrections_.resize(rigids_.size());
  for (std::size_t place = 0; place < rigids_.size(); ++place)
    corrections_[place] = contacts_.correction(place);
  if (joints_.is_empty()) return;
  // Those that joints have moved step by step move on by their final velocities, too.
  for (const BodyMotion& moved : joints_.end()) {
    const auto place = static_cast<std::size_t>(moved.body);
    const Contacts::Body& body = bodies_[place];
    const Contacts::Motion change = contacts_.change(place);
    const Eigen::Vector3d linear = (body.linear + change.linear).cast<double>();
    const Eigen::Vector3d angular = (body.angular + change.angular).cast<double>();
    const Eigen::AngleAxisd turn(rotation(angular * dt_).conjugate() * moved.turn);
    corrections_[place] = {(moved.way - linear * dt_).cast<btScalar>(),
                           (turn.axis() * turn.angle()).cast<btScalar>()};
  }
}

void SmallStepSolver::write_impulses() {
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    const Contacts::Patch& patch = patches_[p];
    const btScalar share = 1 / static_cast<btScalar>(patch.points);
    for (std::size_t n = 0; n < patch.points; ++n) {
      btManifoldPoint& point = *points_[p].point[n];
      point.m_appliedImpulse = patch.point[n].impulse;
      keep_friction(point, bt(patch.friction_impulse) * share, patch.twist_impulse * share);
    }
  }
}

// Bodies then move on by the velocities that they end with: what is corrected here is all but that.
void SmallStepSolver::write_bodies() {
  for (std::size_t place = 0; place < rigids_.size(); ++place) {
    btRigidBody& rigid = *rigids_[place];
    const Contacts::Body& body = bodies_[place];
    // Bodies without rows move as in free flight, bit for bit.
    if (!is_pushed_[place]) {
      rigid.setLinearVelocity(bt(body.linear + body.linear_force));
      rigid.setAngularVelocity(bt(body.angular + body.angular_force));
      continue;
    }
    const Contacts::Motion change = contacts_.change(place);
    rigid.setLinearVelocity(bt(body.linear + change.linear));
    rigid.setAngularVelocity(bt(body.angular + change.angular));
    btTransform& pose = rigid.getWorldTransform();
    pose.setOrigin(pose.getOrigin() + bt(corrections_[place].linear));
    pose.setBasis(turned(pose.getBasis(), corrections_[place].angular));
  }
}

}  // namespace tessera::bullet
