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

JointAssembly::Matrix JointAssembly::columns(bool is_held) const {
  std::vector<Eigen::Triplet<double>> entries;
  Index column = 0;
  const auto append = [&](Index body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    const Index first = kBodyNumbers * body;
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, column, linear[i]);
      entries.emplace_back(first + 3 + i, column, angular[i]);
    }
  };
  const auto append_tie = [&](const Tie& tie, const JointRow& row) {
    append(tie.child, row.linear, row.angular_child);
    if (tie.parent) append(*tie.parent, -row.linear, -row.angular_parent);
  };
  for (const Tie& tie : ties_) {
    for (const JointRow& row : tie.rows) {
      if (row.is_held != is_held) continue;
      append_tie(tie, row);
      ++column;
    }
  }
  for (const Link& link : links_) {
    if (!is_held) break;
    append_tie(ties_[link.follower], link.rows[0]);
    append_tie(ties_[link.leader], link.rows[1]);
    ++column;
  }
  Matrix matrix(kBodyNumbers * static_cast<Index>(bodies_.size()), column);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

JointAssembly::Matrix JointAssembly::inverse_masses() const {
  std::vector<Eigen::Triplet<double>> entries;
  Index first = 0;
  for (const Body& body : bodies_) {
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, first + i, body.now.inverse_mass);
      for (Index j = 0; j < 3; ++j)
        entries.emplace_back(first + 3 + i, first + 3 + j, body.now.inverse_inertia(i, j));
    }
    first += kBodyNumbers;
  }
  Matrix matrix(first, first);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Those without a compliance.
void JointAssembly::make_held_rows_after(const VectorXd& velocities) {
  std::vector<JointRow> rows;
  for (Tie& tie : ties_) {
    rows.clear();
    append_held_rows(*tie.joint.properties, after(tie, velocities, span_), rows);
    std::copy(rows.begin(), rows.end(), tie.rows.begin());
  }
  for (Link& link : links_) {
    link.rows = link.coupling.rows(after(ties_[link.follower], velocities, span_),
                                   after(ties_[link.leader], velocities, span_));
  }
}

}  // namespace tessera::joints
