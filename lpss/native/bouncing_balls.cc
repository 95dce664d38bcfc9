#include "lpss/native/bouncing_balls.h"

#include <cmath>

namespace tessera::native {
namespace {

const Part* ball_of(const Body& body) {
  const std::vector<Part>& parts = body.solid->parts();
  return parts.size() == 1 && parts.front().kind == Part::Kind::kBall ? &parts.front() : nullptr;
}

}  // namespace

void find_where_balls_met(const Body& a, const Body& b, Scalar dt, Contact& contact) {
  if (contact.patches.size() != 1 || contact.patches.front().count != 1 || !(contact.restitution > 0)) return;
  const Part* const ball_a = ball_of(a);
  const Part* const ball_b = ball_of(b);
  if (!ball_a || !ball_b || !a.is_dynamic() || !b.is_dynamic()) return;
  ContactPatch& patch = contact.patches.front();
  ContactPoint& point = patch.point[0];
  const Vector lever_a = a.pose.rotation * ball_a->frame.position;
  const Vector lever_b = b.pose.rotation * ball_b->frame.position;
  const Eigen::Vector3d apart =
      (a.pose.position - b.pose.position + (lever_a - lever_b)).cast<double>();  // from b to a
  const Eigen::Vector3d velocity =
      (a.linear + a.angular.cross(lever_a) - b.linear - b.angular.cross(lever_b)).cast<double>();
  // |apart - velocity t| = reach, for the smaller t >= 0.
  const double reach = double(ball_a->radius) + double(ball_b->radius);
  const double square = velocity.squaredNorm();
  const double approach = -apart.dot(velocity);
  const double inside = reach * reach - apart.squaredNorm();
  if (!(approach > 0) || !(inside > 0)) return;
  const double time = inside / (approach + std::sqrt(approach * approach + square * inside));
  if (!(time <= double(dt))) return;
  const Vector normal = (apart - velocity * time).normalized().cast<Scalar>();
  patch.normal = normal;
  point.on_a = ball_a->frame.position - a.pose.rotation.transpose() * (normal * Scalar(ball_a->radius));
  point.on_b = ball_b->frame.position + b.pose.rotation.transpose() * (normal * Scalar(ball_b->radius));
}

}  // namespace tessera::native
