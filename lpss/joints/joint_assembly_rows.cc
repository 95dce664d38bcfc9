// Makes the rows of an assembly, and matrices of them.

#include <algorithm>
#include <cstddef>
#include <map>
#include <vector>

#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

}  // namespace

// A leader that is not here has gone.
void JointAssembly::add_links() {
  std::map<JointId, std::size_t> places;
  for (std::size_t n = 0; n < ties_.size(); ++n) places.emplace(ties_[n].joint.id, n);
  for (std::size_t n = 0; n < ties_.size(); ++n) {
    const JointProperties& follower = *ties_[n].joint.properties;
    for (int axis = 0; axis < axis_count(follower.type); ++axis) {
      const AxisMimic& mimic = follower.axes[static_cast<std::size_t>(axis)].mimic;
      const auto found = mimic.is_set() ? places.find(mimic.leader) : places.end();
      if (found == places.end()) continue;
      const JointProperties& leader = *ties_[found->second].joint.properties;
      if (mimic.axis >= axis_count(leader.type)) continue;
      links_.push_back({{follower, axis, leader}, n, found->second, {}});
    }
  }
}

void JointAssembly::make_rows() {
  std::vector<double> wanted;
  std::vector<double> errors;
  std::vector<double> compliances;
  const double parts = moves_ ? 1 : steps_;  // of what a row's impulse is shared among
  const auto add = [&](double velocity, double error, double compliance) {
    wanted.push_back(velocity);
    errors.push_back(error);
    compliances.push_back(compliance * parts);
  };
  for (Tie& tie : ties_) {
    make_tie_rows(tie);
    for (const JointRow& row : tie.rows) {
      if (row.is_held) add(row.velocity, row.error, row.compliance);
    }
  }
  for (Link& link : links_) {
    link.rows = link.coupling.rows(posed_of(link.follower), posed_of(link.leader));
    const double rate =
        parents_rate(ties_[link.follower], link.rows[0]) + parents_rate(ties_[link.leader], link.rows[1]);
    add(rate, link.coupling.error(posed_of(link.follower), posed_of(link.leader)), 0);
  }
  const auto as_vector = [](const std::vector<double>& numbers) {
    return VectorXd(Eigen::Map<const VectorXd>(numbers.data(), static_cast<Index>(numbers.size())));
  };
  wanted_ = as_vector(wanted);
  errors_ = as_vector(errors);
  compliances_ = as_vector(compliances);
  const bool any_soft = (compliances_.array() > 0).any();
  is_soft_ = any_soft ? VectorXd((compliances_.array() > 0).cast<double>()) : VectorXd();
  soft_impulses_ = VectorXd::Zero(is_soft_.size());
  if (!factorise()) return;
  bent_ = bending_ = VectorXd::Zero(wanted_.size());
  is_bent_ = false;
  is_held_ = false;
  is_foreseen_ = true;
  put_right();
}

void JointAssembly::make_tie_rows(Tie& tie) {
  const SolvedJoint& joint = tie.joint;
  const auto inertia_of = [&](Index body) {
    const JointedBody& now = bodies_[static_cast<std::size_t>(body)].now;
    return Inertia{now.inverse_mass, now.inverse_inertia};
  };
  tie.rows.clear();
  append_joint_rows(
      {*joint.properties, *joint.drives, joint.posed, tie.parent ? inertia_of(*tie.parent) : Inertia{},
       inertia_of(tie.child), span_, moves_ ? steps_ : 1},
      tie.rows);
  if (tie.parent) return;
  for (JointRow& row : tie.rows) row.velocity += parents_rate(tie, row);
}

// The motion of a parent that nothing can push goes into the rows.
double JointAssembly::parents_rate(const Tie& tie, const JointRow& row) const {
  if (tie.parent) return 0;
  const JointSide& parent = tie.joint.posed.parent;
  return row.linear.dot(parent.linear_velocity) + row.angular_parent.dot(parent.angular_velocity);
}

// The bodies of each tie, then of each link.
void JointAssembly::make_nodes() {
  std::vector<std::vector<Index>> nodes;
  const auto bodies_of = [](const Tie& tie) {
    return tie.parent ? std::vector<Index>{tie.child, *tie.parent} : std::vector<Index>{tie.child};
  };
  for (const Tie& tie : ties_) nodes.push_back(bodies_of(tie));
  for (const Link& link : links_) {
    std::vector<Index>& bodies = nodes.emplace_back(bodies_of(ties_[link.follower]));
    for (const Index body : bodies_of(ties_[link.leader])) {
      if (std::ranges::find(bodies, body) == bodies.end()) bodies.push_back(body);
    }
  }
  held_.set_nodes(nodes, static_cast<Index>(bodies_.size()));
}

void JointAssembly::fill_held() {
  held_.clear();
  const auto add = [this](std::size_t node, const Tie& tie, const JointRow& row) {
    held_.add(node, tie.child, row.linear, row.angular_child);
    if (tie.parent) held_.add(node, *tie.parent, -row.linear, -row.angular_parent);
  };
  std::size_t node = 0;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : tie.rows) {
      if (!row.is_held) continue;
      held_.add_row(node);
      add(node, tie, row);
    }
    ++node;
  }
  for (const Link& link : links_) {
    held_.add_row(node);
    add(node, ties_[link.follower], link.rows[0]);
    add(node, ties_[link.leader], link.rows[1]);
    ++node;
  }
}

VectorXd JointAssembly::over_bodies(const Tie& tie, const JointRow& row) const {
  VectorXd whole = VectorXd::Zero(velocities_.size());
  const auto put = [&](Index body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    whole.segment<3>(kBodyNumbers * body) = linear;
    whole.segment<3>(kBodyNumbers * body + 3) = angular;
  };
  put(tie.child, row.linear, row.angular_child);
  if (tie.parent) put(*tie.parent, -row.linear, -row.angular_parent);
  return whole;
}

// Of the velocities, to a unit of impulse.
VectorXd JointAssembly::answer_to(const VectorXd& row) const {
  VectorXd answer(row.size());
  Index first = 0;
  for (const Body& body : bodies_) {
    answer.segment<3>(first) = body.now.inverse_mass * row.segment<3>(first);
    answer.segment<3>(first + 3) = body.now.inverse_inertia * row.segment<3>(first + 3);
    first += kBodyNumbers;
  }
  return answer;
}

// Those without a compliance.
void JointAssembly::make_held_rows_after(const VectorXd& velocities) {
  std::vector<JointRow> rows;
  const std::vector<Eigen::Quaterniond> turned = turns(velocities, span_);
  for (Tie& tie : ties_) {
    rows.clear();
    append_held_rows(*tie.joint.properties, after(tie, velocities, span_, turned), rows);
    std::copy(rows.begin(), rows.end(), tie.rows.begin());
  }
  for (Link& link : links_) {
    link.rows = link.coupling.rows(after(ties_[link.follower], velocities, span_, turned),
                                   after(ties_[link.leader], velocities, span_, turned));
  }
}

}  // namespace tessera::joints
