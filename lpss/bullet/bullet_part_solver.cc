#include "lpss/bullet/bullet_part_solver.h"

#include "lpss/bullet/conversions.h"

namespace tessera::bullet {
namespace {

// Adds to what was agreed on. All copies round alike, and remember what was rounded.
void add(const Eigen::Vector3d& change, Eigen::Vector3d& agreed, btVector3& velocity) {
  velocity = to_bullet(Eigen::Vector3d(agreed + change));
  agreed = to_eigen(velocity);
}

}  // namespace

void BulletPartSolver::begin(const SolveTask& task, std::span<const std::size_t> shared, double dt) {
  is_empty_ = task.bodies.empty();
  shared_.clear();
  if (is_empty_) return;
  for (std::size_t body : shared) shared_.push_back({body, {}});
  solver_.set_up(task, dt);
}

void BulletPartSolver::pass(int n) {
  if (!is_empty_) solver_.pass(n);
}

VelocityChange BulletPartSolver::change(std::size_t n) const {
  const Shared& shared = shared_[n];
  const btSolverBody& body = solver_.solver_body(shared.body);
  return {to_eigen(body.m_deltaLinearVelocity) - shared.agreed.linear,
          to_eigen(body.m_deltaAngularVelocity) - shared.agreed.angular,
          to_eigen(body.m_pushVelocity) - shared.agreed.push,
          to_eigen(body.m_turnVelocity) - shared.agreed.turn};
}

void BulletPartSolver::agree(std::size_t n, const VelocityChange& change) {
  Shared& shared = shared_[n];
  btSolverBody& body = solver_.solver_body(shared.body);
  add(change.linear, shared.agreed.linear, body.m_deltaLinearVelocity);
  add(change.angular, shared.agreed.angular, body.m_deltaAngularVelocity);
  add(change.push, shared.agreed.push, body.m_pushVelocity);
  add(change.turn, shared.agreed.turn, body.m_turnVelocity);
}

void BulletPartSolver::split(std::size_t n, double times) { solver_.split(shared_[n].body, times); }

void BulletPartSolver::end() {
  if (!is_empty_) solver_.finish();
}

}  // namespace tessera::bullet
