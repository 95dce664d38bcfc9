#include "lpss/islands/island_steps.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace tessera {
namespace {

// The share of a rotor's turn that counts where nothing holds it: in a step it may turn six times as far as
// other bodies.
constexpr double kResisted = 0.16;

}  // namespace

template <typename Scalar>
std::span<const int> IslandSteps<Scalar>::of(std::span<const IslandEnd> islands, const Islands<Scalar>& all,
                                             const ContactNeeds& needs, double dt) {
  steps_.clear();
  std::size_t begin = 0;
  for (const IslandEnd& island : islands) {
    steps_.push_back(needs.granted(std::max(needs.least(), island.substeps), island.bodies - begin));
    begin = island.bodies;
  }
  if (all.joints.empty()) return steps_;
  island_of_.clear();
  for (std::size_t n = 0; n < islands.size(); ++n) island_of_.resize(islands[n].bodies, n);
  ask_for_turns(all, needs, dt);
  ask_for_loads(all, needs);
  return steps_;
}

// The island of a body asks for so many.
template <typename Scalar>
void IslandSteps<Scalar>::ask(std::size_t body, int steps) {
  int& most = steps_[island_of_[body]];
  most = std::max(most, steps);
}

template <typename Scalar>
void IslandSteps<Scalar>::see(const Islands<Scalar>& all, const IslandJoint& joint, bool is_child) {
  const std::size_t place = is_child ? joint.child : joint.parent;
  const std::size_t other = is_child ? joint.parent : joint.child;
  if (place == IslandJoint::kNoBody) return;
  Turning& turning = turning_[place];
  turning.is_tied = true;
  turning.rotor.add(joint.form->type, is_child, is_child ? joint.form->in_child : joint.form->in_parent,
                    double(all.bodies[place].inverse_mass),
                    all.frames[place].inverse_moments.template cast<double>());
  if (!turning.rotor.axis()) return;
  const double carrier = other == IslandJoint::kNoBody ? std::numeric_limits<double>::infinity()
                                                       : double(all.frames[other].moments.minCoeff());
  turning.carrier_moment = std::max(turning.carrier_moment, carrier);
}

// rad/s.
template <typename Scalar>
double IslandSteps<Scalar>::turn_of(const Islands<Scalar>& all, std::size_t body) const {
  const Eigen::Vector3d rate = all.bodies[body].angular.template cast<double>();
  const std::optional<Eigen::Vector3d>& axis_in_body = turning_[body].rotor.axis();
  if (!axis_in_body) return rate.norm();
  const auto& frame = all.frames[body];
  const Eigen::Vector3d axis = frame.rotation.template cast<double>() * *axis_in_body;
  const Eigen::Vector3d tilt = joints::tilt_rate(axis, rate);
  const Eigen::Vector3d moments = frame.moments.template cast<double>();
  const double about = axis_in_body->dot(moments.cwiseProduct(*axis_in_body));
  const double resists = about / ((moments.sum() - about) / 2 + turning_[body].carrier_moment);
  return std::min(rate.norm(), std::max(tilt.norm(), kResisted * resists * (rate - tilt).norm()));
}

// A rotor may turn about its axis as fast as it likes, but it resists a tilt, and what holds it takes that
// up. Passes find how, which takes more steps where that is light beside the rotor.
template <typename Scalar>
void IslandSteps<Scalar>::ask_for_turns(const Islands<Scalar>& all, const ContactNeeds& needs, double dt) {
  turning_.assign(all.dynamics, {});
  for (const IslandJoint& joint : all.joints) {
    see(all, joint, /*is_child=*/true);
    see(all, joint, /*is_child=*/false);
  }
  for (std::size_t body = 0; body < all.dynamics; ++body) {
    if (turning_[body].is_tied) ask(body, needs.for_turn(turn_of(all, body) * dt));
  }
}

// Takes off what hangs on a single joint, again and again: what is left are loops, and what holds all of it.
// The order in an island does not depend on others.
template <typename Scalar>
void IslandSteps<Scalar>::ask_for_loads(const Islands<Scalar>& all, const ContactNeeds& needs) {
  hanging_.assign(all.dynamics, {});
  for (std::size_t body = 0; body < all.dynamics; ++body)
    hanging_[body].mass = 1 / double(all.bodies[body].inverse_mass);
  for (std::size_t n = 0; n < all.joints.size(); ++n) {
    for (const std::size_t body : {all.joints[n].child, all.joints[n].parent}) {
      if (body == IslandJoint::kNoBody) continue;
      ++hanging_[body].joints;
      hanging_[body].all ^= n;
    }
  }
  ends_.clear();
  for (std::size_t body = 0; body < all.dynamics; ++body) {
    if (hanging_[body].joints == 1) ends_.push_back(body);
  }
  for (std::size_t n = 0; n < ends_.size(); ++n) {
    Hanging& end = hanging_[ends_[n]];
    if (end.joints == 0) continue;  // the last of a tree that nothing holds
    const IslandJoint& joint = all.joints[end.all];
    const bool is_child = joint.child == ends_[n];
    const std::size_t holder = is_child ? joint.parent : joint.child;
    if (holder == IslandJoint::kNoBody) continue;  // the world holds it
    const Eigen::Vector3d lever = (is_child ? joint.form->in_parent : joint.form->in_child).position;
    const Eigen::Vector3d mobilities = all.frames[holder].inverse_moments.template cast<double>();
    const double across =
        mobilities.sum() - mobilities.dot(lever.cwiseAbs2()) / std::max(lever.squaredNorm(), 1e-30);
    ask(holder, needs.for_pull(end.mass, lever.norm(), across));
    hanging_[holder].mass += end.mass;
    hanging_[holder].all ^= end.all;
    end.joints = 0;
    if (--hanging_[holder].joints == 1) ends_.push_back(holder);
  }
}

template class IslandSteps<float>;
template class IslandSteps<double>;

}  // namespace tessera
