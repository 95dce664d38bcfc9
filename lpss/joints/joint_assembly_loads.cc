// What the joints of an assembly give and bear in a step.
//
// Joints change the momenta of bodies by what is left of all changes once those of forces, contacts and free
// turning are taken out. In a tree, each joint bears what all bodies beyond it got: the backward pass of the
// recursive Newton-Euler algorithm (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 5.3). In a
// loop, that leaves several solutions; it is that of the rows, which give way a little.

#include <cstddef>
#include <span>

#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

void JointAssembly::find_ends() {
  std::vector<Hanging>& hanging = memory_.hanging;
  std::vector<std::size_t>& open = memory_.open_ends;
  hanging.assign(bodies_.size(), {});
  open.clear();
  const auto of = [&](Index body) -> Hanging& { return hanging[static_cast<std::size_t>(body)]; };
  const auto hang = [&](Index body, std::size_t tie) {
    ++of(body).joints;
    of(body).all ^= tie;
  };
  for (std::size_t n = 0; n < ties_.size(); ++n) {
    hang(ties_[n].child, n);
    if (ties_[n].parent) hang(*ties_[n].parent, n);
  }
  for (std::size_t body = 0; body < hanging.size(); ++body) {
    if (hanging[body].joints == 1) open.push_back(body);
  }
  while (!open.empty()) {
    const std::size_t body = open.back();
    open.pop_back();
    if (hanging[body].joints == 0) continue;  // the last of a tree that nothing holds
    const std::size_t n = hanging[body].all;
    const Tie& tie = ties_[n];
    const bool is_child = tie.child == static_cast<Index>(body);
    ends_.push_back({n, is_child});
    hanging[body].joints = 0;
    if (is_child && !tie.parent) continue;
    Hanging& other = of(is_child ? *tie.parent : tie.child);
    other.all ^= n;
    if (--other.joints == 1) open.push_back(static_cast<std::size_t>(&other - hanging.data()));
  }
}

void JointAssembly::begin_impulses() {
  has_begun_ = true;
  began_ = velocities_;
  pushed_.setZero(velocities_.size());
  for (Body& body : bodies_) body.began_beyond = body.beyond_middle;
}

void JointAssembly::note_impulses() {
  if (!has_begun_) return;
  has_begun_ = false;
  note_efforts();
  VectorXd& changes = memory_.whole;
  changes = velocities_ - began_ - pushed_;
  if (ends_.empty()) return note_by_rows(changes);
  momenta_of(changes);
  Index first = 0;
  for (const Body& body : bodies_) {
    memory_.momenta.segment<3>(first + 3) -= body.beyond_middle - body.began_beyond;
    first += kBodyNumbers;
  }
  note_from_ends(memory_.momenta);
}

void JointAssembly::note_efforts() {
  for (const FreeRow& free : free_rows()) {
    Tie& tie = ties_[static_cast<std::size_t>(directions_[free.direction].tie - ties_.data())];
    tie.impulses.effort[static_cast<std::size_t>(free.row->axis)] += free.impulse;
  }
  if (is_soft_.size() == 0) return;
  Index n = 0;
  for (Tie& tie : ties_) {
    for (const JointRow& row : std::span(tie.rows).first(static_cast<std::size_t>(tie.held)))
      tie.impulses.effort[static_cast<std::size_t>(row.axis)] += soft_impulses_[n++];
  }
  // What an armature keeps for itself.
  for (const Armature& of : armatures_) {
    Tie& tie = ties_[of.tie];
    const JointRow& row = tie.rows[of.row];
    const auto axis = static_cast<std::size_t>(row.axis);
    tie.impulses.effort[axis] += row.armature * (rate_of(tie, row) - tie.rates[axis]);
  }
}

// On the child, the torque about its centre; world axes.
void JointAssembly::note_impulse(Tie& tie, const Vector3d& force, const Vector3d& torque) const {
  const PosedJoint& posed = tie.joint.posed;
  const Pose frame = posed.child_frame();
  const Vector3d lever = frame.position - posed.child.pose.position;
  const auto add = [&frame](std::array<double, 3>& sum, const Vector3d& more) {
    Eigen::Map<Vector3d>(sum.data()) += frame.orientation.conjugate() * more;
  };
  add(tie.impulses.force, force);
  add(tie.impulses.torque, torque - lever.cross(force));
}

// `momenta`, which joints have given to bodies, become those that joints still give to what hangs on them.
void JointAssembly::note_from_ends(VectorXd& momenta) {
  for (const End& end : ends_) {
    Tie& tie = ties_[end.tie];
    const JointPoses poses{tie.joint.posed.parent.pose, tie.joint.posed.child.pose};
    const Vector3d way = poses.child.position - poses.parent.position;
    if (end.is_child) {
      const auto of = momenta.segment<6>(kBodyNumbers * tie.child);
      note_impulse(tie, of.head<3>(), of.tail<3>());
      if (!tie.parent) continue;
      auto by = momenta.segment<6>(kBodyNumbers * *tie.parent);
      by.tail<3>() += of.tail<3>() + way.cross(of.head<3>());
      by.head<3>() += of.head<3>();
    } else {
      const auto of = momenta.segment<6>(kBodyNumbers * *tie.parent);
      const Vector3d force = of.head<3>();
      const Vector3d torque = of.tail<3>() - way.cross(force);  // about the centre of the child
      note_impulse(tie, -force, -torque);
      auto by = momenta.segment<6>(kBodyNumbers * tie.child);
      by.head<3>() += force;
      by.tail<3>() += torque;
    }
  }
}

// `changes` are those of velocities.
void JointAssembly::note_by_rows(VectorXd& changes) {
  Index first = 0;
  for (const Body& body : bodies_) {
    changes.segment<3>(first + 3) -= body.now.inverse_inertia * (body.beyond_middle - body.began_beyond);
    first += kBodyNumbers;
  }
  const auto take_out = [&](Index body, const Vector3d& force, const Vector3d& torque) {
    const JointedBody& now = bodies_[static_cast<std::size_t>(body)].now;
    changes.segment<3>(kBodyNumbers * body) -= now.inverse_mass * force;
    changes.segment<3>(kBodyNumbers * body + 3) -= now.inverse_inertia * torque;
  };
  for (const FreeRow& free : free_rows()) {
    const JointRow& row = *free.row;
    Tie& tie = ties_[static_cast<std::size_t>(directions_[free.direction].tie - ties_.data())];
    take_out(tie.child, row.linear * free.impulse, row.angular_child * free.impulse);
    if (tie.parent) take_out(*tie.parent, row.linear * -free.impulse, row.angular_parent * -free.impulse);
    note_impulse(tie, row.linear * free.impulse, row.angular_child * free.impulse);
  }
  VectorXd& rates = memory_.rates;
  VectorXd& impulses = memory_.impulses;
  held_.rates(changes, rates);
  if (is_soft_.size() > 0) rates += compliances_.cwiseProduct(soft_impulses_);
  held_.solve(rates, impulses);
  Index n = 0;
  for (Tie& tie : ties_) {
    for (const JointRow& row : std::span(tie.rows).first(static_cast<std::size_t>(tie.held))) {
      note_impulse(tie, row.linear * impulses[n], row.angular_child * impulses[n]);
      ++n;
    }
  }
  for (const Link& link : links_) {
    const std::size_t of[] = {link.follower, link.leader};
    for (std::size_t side = 0; side < 2; ++side) {
      const JointRow& row = link.rows[side];
      note_impulse(ties_[of[side]], row.linear * impulses[n], row.angular_child * impulses[n]);
    }
    ++n;
  }
}

void JointAssembly::write_impulses(std::span<JointLoads> impulses) const {
  for (const Tie& tie : ties_) impulses[tie.joint.place] = has_diverged_ ? JointLoads{} : tie.impulses;
}

}  // namespace tessera::joints
