#include "lpss/bullet/substep_solver.h"

#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lpss/bullet/conversions.h"
#include "lpss/bullet/joint_rows.h"

namespace tessera::bullet {
namespace {

// A contact is a spring that its load compresses: at 30 Hz, as in Box2D, a tower of ten boxes is 27 mm lower,
// and one of twenty buckles; at 60 Hz 7 mm, and both stand. Stiffer ones need more passes than is
// practical.
constexpr btScalar kFrequencyTick = 1;     // of the rate of ticks, at most
constexpr btScalar kFrequencyStep = 0.25;  // of the rate of steps, at most
constexpr btScalar kContactDamping = 10;   // of critical damping
constexpr btScalar kPushSpeedMax = 3;      // m/s, at which overlaps are corrected

// The velocity that a row sees before the tick, without its forces.
btScalar velocity_at_start(const btSolverConstraint& row, std::span<const btSolverBody> bodies) {
  const btSolverBody& a = bodies[static_cast<std::size_t>(row.m_solverBodyIdA)];
  const btSolverBody& b = bodies[static_cast<std::size_t>(row.m_solverBodyIdB)];
  return row.m_contactNormal1.dot(a.m_linearVelocity) + row.m_relpos1CrossNormal.dot(a.m_angularVelocity) +
         row.m_contactNormal2.dot(b.m_linearVelocity) + row.m_relpos2CrossNormal.dot(b.m_angularVelocity);
}

const btManifoldPoint& point_of(const btSolverConstraint& contact) {
  return *static_cast<const btManifoldPoint*>(contact.m_originalContactPoint);
}

// The direction of a row, even if its first body cannot move.
btVector3 direction_of(const btSolverConstraint& row) {
  return row.m_contactNormal1.isZero() ? -row.m_contactNormal2 : row.m_contactNormal1;
}

}  // namespace

SubstepSolver::SubstepSolver(int steps, int passes)
    : usual_steps_(steps), steps_(steps), passes_(std::max(2, (passes + steps - 1) / steps)) {}

void SubstepSolver::begin(const RowPools& pools, JointSolver& joints, const btContactSolverInfo& info) {
  pools_ = pools;
  joints_ = &joints;
  info_ = info;
  forced_ = 0;
  step_ = info.m_timeStep / static_cast<btScalar>(steps_);
  const btScalar stiffer = std::max(btScalar(1), btScalar(steps_) / btScalar(usual_steps_));
  const btScalar frequency = std::min(stiffer * kFrequencyTick / info.m_timeStep, kFrequencyStep / step_);
  const btScalar omega = 2 * std::numbers::pi_v<btScalar> * frequency;
  const btScalar a = 2 * kContactDamping + step_ * omega;
  const btScalar b = step_ * omega * a;
  push_rate_ = omega / a;
  impulse_share_ = 1 / (1 + b);
  mass_share_ = b * impulse_share_;

  const btVector3 none(0, 0, 0);
  motions_.clear();
  for (const btSolverBody& body : pools.bodies) {
    motions_.push_back({none, none, none, none, body.m_invMass.x()});
  }
  for (const btSolverConstraint& row : pools.contacts) {
    motions_[static_cast<std::size_t>(row.m_solverBodyIdA)].is_pushed = true;
    motions_[static_cast<std::size_t>(row.m_solverBodyIdB)].is_pushed = true;
  }
  contacts_.clear();
  for (const btSolverConstraint& row : pools.contacts) {
    const btManifoldPoint& point = point_of(row);
    const btScalar gap = point.getDistance();
    const btScalar start = velocity_at_start(row, pools.bodies);
    const bool bounces = -start > info.m_restitutionVelocityThreshold;
    contacts_.push_back({start, gap, std::min(-gap / info.m_timeStep, btScalar(0)),
                         bounces ? point.m_combinedRestitution * -start : 0});
  }
  frictions_.clear();
  for (const btSolverConstraint& row : pools.frictions)
    frictions_.push_back({velocity_at_start(row, pools.bodies)});
  recall_impulses();
  begin_joints();
}

void SubstepSolver::round(int n) {
  if (n + 1 == rounds()) {
    end_step();
    rebound();
    return joints_->pass();
  }
  const int number = n % rounds_per_step();
  if (number == 0) {
    if (n > 0) end_step();
    return start_step();
  }
  const bool corrects = number < passes_;
  if (!corrects) {
    close_gaps();
    add_way(step_);
    joints_->move();
  }
  pass(corrects);
}

void SubstepSolver::begin_joints() {
  if (joints_->is_empty()) return;
  std::vector<JointedBody> bodies(pools_.bodies.size());
  for (const int body : joints_->bodies()) {
    const auto place = static_cast<std::size_t>(body);
    Motion& motion = motions_[place];
    motion.is_pushed = true;
    bodies[place] = jointed(pools_.bodies[place]);
    bodies[place].linear_change = &motion.linear;
    bodies[place].angular_change = &motion.angular;
  }
  joints_->set_up(bodies, info_.m_timeStep, steps_);
}

// The impulses of the last tick, scaled to a step. Friction rows follow the sliding velocity; their stored
// impulses are along directions that depend on the normal alone.
void SubstepSolver::recall_impulses() {
  const btScalar share = 1 / static_cast<btScalar>(steps_);
  for (btSolverConstraint& row : pools_.contacts) {
    const btManifoldPoint& point = point_of(row);
    row.m_appliedImpulse = point.m_appliedImpulse * share;
    btVector3 p, q;
    btPlaneSpace1(point.m_normalWorldOnB, p, q);
    const btVector3 kept = (p * point.m_appliedImpulseLateral1 + q * point.m_appliedImpulseLateral2) * share;
    for (int k = 0; k < pools_.friction_directions; ++k) {
      btSolverConstraint& friction = pools_.frictions[static_cast<std::size_t>(row.m_frictionIndex + k)];
      const btScalar most = friction.m_friction * row.m_appliedImpulse;
      friction.m_appliedImpulse = std::clamp(kept.dot(direction_of(friction)), -most, most);
    }
  }
}

btScalar SubstepSolver::velocity_change(const btSolverConstraint& row) const {
  const Motion& a = motions_[static_cast<std::size_t>(row.m_solverBodyIdA)];
  const Motion& b = motions_[static_cast<std::size_t>(row.m_solverBodyIdB)];
  return row.m_contactNormal1.dot(a.linear) + row.m_relpos1CrossNormal.dot(a.angular) +
         row.m_contactNormal2.dot(b.linear) + row.m_relpos2CrossNormal.dot(b.angular);
}

void SubstepSolver::push(const btSolverConstraint& row, btScalar impulse) {
  Motion& a = motions_[static_cast<std::size_t>(row.m_solverBodyIdA)];
  Motion& b = motions_[static_cast<std::size_t>(row.m_solverBodyIdB)];
  a.linear += row.m_contactNormal1 * (a.inverse_mass * impulse);
  a.angular += row.m_angularComponentA * impulse;
  b.linear += row.m_contactNormal2 * (b.inverse_mass * impulse);
  b.angular += row.m_angularComponentB * impulse;
}

void SubstepSolver::set_impulse(btSolverConstraint& row, btScalar impulse) {
  push(row, impulse - row.m_appliedImpulse);
  row.m_appliedImpulse = impulse;
}

void SubstepSolver::set_change(std::size_t body, const btVector3& linear, const btVector3& angular) {
  Motion& motion = motions_[body];
  motion.linear = linear + linear_force(body);
  motion.angular = angular + angular_force(body);
  motion.is_pushed = true;
}

// Forces of one step, and the impulses of the step before.
void SubstepSolver::start_step() {
  const btScalar share = 1 / static_cast<btScalar>(steps_);
  forced_ += share;
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    motions_[i].linear += pools_.bodies[i].m_externalForceImpulse * share;
    motions_[i].angular += pools_.bodies[i].m_externalTorqueImpulse * share;
  }
  for (const auto& rows : {pools_.contacts, pools_.frictions}) {
    for (const btSolverConstraint& row : rows) push(row, row.m_appliedImpulse);
  }
  joints_->start_step();
}

void SubstepSolver::pass(bool corrects) {
  for (std::size_t i = 0; i < pools_.contacts.size(); ++i) {
    solve_contact(pools_.contacts[i], contacts_[i], corrects);
  }
  for (const btSolverConstraint& contact : pools_.contacts) {
    for (int k = 0; k < pools_.friction_directions; ++k) {
      const auto place = static_cast<std::size_t>(contact.m_frictionIndex + k);
      btSolverConstraint& row = pools_.frictions[place];
      const btScalar most = row.m_friction * contact.m_appliedImpulse;
      const btScalar velocity = frictions_[place].start + velocity_change(row);
      const btScalar impulse = row.m_appliedImpulse - velocity * row.m_jacDiagABInv;
      set_impulse(row, std::clamp(impulse, -most, most));
    }
  }
  joints_->pass();
}

// A gap may close by the end of the tick; an overlap is opened like an overdamped spring.
void SubstepSolver::solve_contact(btSolverConstraint& row, const Contact& contact, bool corrects) {
  btScalar velocity = contact.approach_max;
  btScalar mass_share = 1;
  btScalar impulse_share = 0;
  if (corrects && contact.gap < 0) {
    velocity = std::min(-contact.gap * push_rate_, kPushSpeedMax);
    mass_share = mass_share_;
    impulse_share = impulse_share_;
  }
  const btScalar missing = velocity - (contact.start + velocity_change(row));
  const btScalar impulse =
      row.m_appliedImpulse * (1 - impulse_share) + missing * row.m_jacDiagABInv * mass_share;
  set_impulse(row, std::max(impulse, btScalar(0)));
}

void SubstepSolver::close_gaps() {
  for (std::size_t i = 0; i < pools_.contacts.size(); ++i) {
    contacts_[i].gap += (contacts_[i].start + velocity_change(pools_.contacts[i])) * step_;
  }
}

void SubstepSolver::add_way(btScalar time) {
  for (Motion& motion : motions_) {
    motion.way += motion.linear * time;
    motion.turn += motion.angular * time;
  }
}

// The way of the last correcting pass without that of the velocities that stay is what took back overlaps.
void SubstepSolver::end_step() {
  add_way(-step_);
  for (std::size_t i = 0; i < pools_.contacts.size(); ++i)
    contacts_[i].total += pools_.contacts[i].m_appliedImpulse;
  for (std::size_t i = 0; i < pools_.frictions.size(); ++i) {
    frictions_[i].total += pools_.frictions[i].m_appliedImpulse;
  }
}

void SubstepSolver::rebound() {
  for (std::size_t i = 0; i < pools_.contacts.size(); ++i) {
    Contact& contact = contacts_[i];
    if (!(contact.rebound > 0) || !(contact.total > 0)) continue;
    btSolverConstraint& row = pools_.contacts[i];
    const btScalar before = row.m_appliedImpulse;
    const btScalar missing = contact.rebound - (contact.start + velocity_change(row));
    set_impulse(row, std::max(before + missing * row.m_jacDiagABInv, btScalar(0)));
    contact.total += row.m_appliedImpulse - before;
  }
}

// Bodies then move on by the velocity that they end with: what is corrected is all but that.
void SubstepSolver::set_way(const BodyMotion& moved) {
  const double time = info_.m_timeStep;
  btSolverBody& body = pools_.bodies[static_cast<std::size_t>(moved.body)];
  const Motion& motion = motions_[static_cast<std::size_t>(moved.body)];
  const Eigen::Vector3d linear = to_eigen(body.m_linearVelocity + motion.linear);
  const Eigen::Vector3d angular = to_eigen(body.m_angularVelocity + motion.angular);
  const Eigen::AngleAxisd turn(rotation(angular * time).conjugate() * moved.turn);
  body.m_pushVelocity = to_bullet(Eigen::Vector3d(moved.way / time - linear));
  body.m_turnVelocity =
      to_bullet(Eigen::Vector3d(turn.axis() * turn.angle() / (time * info_.m_splitImpulseTurnErp)));
}

void SubstepSolver::end() {
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const Motion& motion = motions_[i];
    btSolverBody& body = pools_.bodies[i];
    body.m_deltaLinearVelocity.setZero();
    body.m_deltaAngularVelocity.setZero();
    // Bodies without rows move as in Bullet, bit for bit.
    if (!motion.is_pushed) continue;
    body.m_deltaLinearVelocity = motion.linear - body.m_externalForceImpulse;
    body.m_deltaAngularVelocity = motion.angular - body.m_externalTorqueImpulse;
    body.m_pushVelocity = motion.way / info_.m_timeStep;
    body.m_turnVelocity = motion.turn / (info_.m_timeStep * info_.m_splitImpulseTurnErp);
  }
  for (const BodyMotion& moved : joints_->end()) set_way(moved);
  for (std::size_t i = 0; i < pools_.contacts.size(); ++i) {
    btSolverConstraint& row = pools_.contacts[i];
    row.m_appliedImpulse = contacts_[i].total;
    btVector3 sum(0, 0, 0);
    for (int k = 0; k < pools_.friction_directions; ++k) {
      const auto place = static_cast<std::size_t>(row.m_frictionIndex + k);
      sum += direction_of(pools_.frictions[place]) * frictions_[place].total;
    }
    btVector3 kept[2];
    btPlaneSpace1(point_of(row).m_normalWorldOnB, kept[0], kept[1]);
    for (int k = 0; k < pools_.friction_directions; ++k) {
      pools_.frictions[static_cast<std::size_t>(row.m_frictionIndex + k)].m_appliedImpulse = sum.dot(kept[k]);
    }
  }
}

}  // namespace tessera::bullet
