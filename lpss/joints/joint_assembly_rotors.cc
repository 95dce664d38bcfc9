// The turns and rates of an assembly's rotors.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

}  // namespace

void JointAssembly::find_rotors() {
  has_rotors_ = false;
  if (steps_ == 1) return;
  const auto add = [&](Index n, const Tie& tie, bool is_child) {
    Body& body = bodies_[static_cast<std::size_t>(n)];
    const PosedJoint& posed = tie.joint.posed;
    body.rotor.add(tie.joint.form->type, is_child, is_child ? posed.in_child : posed.in_parent,
                   body.now.inverse_mass, body.now.inverse_moments);
    body.spin_axis.reset();
    if (!body.rotor.axis()) return;
    body.spin_axis = (is_child ? posed.child : posed.parent).pose.orientation * *body.rotor.axis();
  };
  for (const Tie& tie : ties_) {
    add(tie.child, tie, true);
    if (tie.parent) add(*tie.parent, tie, false);
  }
  has_rotors_ = std::ranges::any_of(bodies_, [](const Body& body) { return body.spin_axis.has_value(); });
}

// The rate that turns a body's inertia and its joints.
Eigen::Vector3d JointAssembly::turning(const Body& body, const Eigen::Vector3d& rate) const {
  return spins(body) ? tilt_rate(*body.spin_axis, rate) : rate;
}

void JointAssembly::split_turns_of_rotors(const VectorXd& velocities, double time, BodyTurns& turns) const {
  turns.tilts = turns.whole;
  Index first = 3;
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    if (spins(bodies_[n])) {
      const Eigen::Vector3d rate = velocities.segment<3>(first);
      const Eigen::Vector3d tilting = turning(bodies_[n], rate);
      turns.tilts[n] = rotation_by(tilting * time);
      turns.whole[n] = turns.tilts[n] * rotation_by((rate - tilting) * time);
    }
    first += kBodyNumbers;
  }
}

const VectorXd& JointAssembly::without_spins(const VectorXd& velocities) {
  VectorXd& tilting = memory_.tilting;
  tilting = velocities;
  Index first = 0;
  for (const Body& body : bodies_) {
    auto rate = tilting.segment<3>(first + 3);
    rate = turning(body, rate);
    first += kBodyNumbers;
  }
  return tilting;
}

// Rates turn with the axes: those of now, and those by which bodies are still to be moved, from the way
// `next` on.
void JointAssembly::turn_rates_of_rotors(std::span<const Eigen::Quaterniond> tilts, std::size_t next) {
  Index first = 0;
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    const auto turn = [&](VectorXd& velocities) {
      auto rate = velocities.segment<3>(first + 3);
      rate = (tilts[n] * rate).eval();
    };
    if (bodies_[n].spin_axis) {
      turn(velocities_);
      for (std::size_t way = next; way < ways_count_; ++way) turn(ways_[way]);
    }
    first += kBodyNumbers;
  }
}

}  // namespace tessera::joints
