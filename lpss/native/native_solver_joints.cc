// The joints of the bodies that the solver has, in turns with contacts.
#include <algorithm>
#include <optional>
#include <span>

#include "lpss/base/rotation.h"
#include "lpss/joints/task_joint.h"
#include "lpss/native/native_solver.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

JointSide side_of(const Body& body) {
  return {
      {body.pose.position.cast<double>(), Eigen::Quaterniond(body.pose.rotation.cast<double>()).normalized()},
      body.linear.cast<double>(),
      body.angular.cast<double>()};
}

joints::SolvedJoint solved_joint(const TaskJoint& joint) {
  const Body& child = body_of(joint.child);
  const Body* parent = joint.parent.world ? &body_of(joint.parent) : nullptr;
  std::optional<int> pushed;
  if (parent && parent->is_dynamic()) pushed = static_cast<int>(parent->place);
  std::optional<JointSide> parent_side;
  if (parent) parent_side = side_of(*parent);
  return {joint.id,     static_cast<int>(child.place),
          pushed,       joint.properties,
          joint.drives, joints::posed(joint, side_of(child), parent_side)};
}

bool is_same(const RowBody<Scalar>& a, const RowBody<Scalar>& b) {
  return std::equal(a.linear, a.linear + 3, b.linear) && std::equal(a.angular, a.angular + 3, b.angular);
}

}  // namespace

void NativeSolver::begin_joints() {
  joints_.clear();
  jointed_.clear();
  if (task_->joints.empty()) return;
  for (const TaskJoint& joint : task_->joints) {
    joints_.add(solved_joint(joint));
    // What is fixed to the ground stays in it.
    if (!joint.parent.world && joint.properties->type == JointType::kFixed)
      notes_[body_of(joint.child).place].is_buried = false;
  }
  const std::span<const std::size_t> jointed = joints_.bodies();
  jointed_.assign(jointed.begin(), jointed.end());
  linear_changes_.assign(dynamics_.size(), Vector::Zero());
  angular_changes_.assign(dynamics_.size(), Vector::Zero());
  set_changes_.assign(dynamics_.size(), {Vector::Zero(), Vector::Zero()});
  told_changes_ = set_changes_;
  set_motions_.assign(dynamics_.size(), {});
  if (jointed_bodies_.size() < dynamics_.size()) jointed_bodies_.resize(dynamics_.size());
  for (const std::size_t place : jointed_) {
    notes_[place].is_pushed = true;
    const Contacts::Body& body = bodies_[place];
    jointed_bodies_[place] = {.inverse_mass = body.inverse_mass,
                              .inverse_inertia = dynamics_[place]->exact_inverse_inertia(),
                              .inverse_moments = dynamics_[place]->inverse_moments.cast<double>(),
                              .linear = body.linear.cast<double>(),
                              .angular = body.angular.cast<double>(),
                              .linear_change = joints::SharedVector(linear_changes_[place].data()),
                              .angular_change = joints::SharedVector(angular_changes_[place].data())};
  }
  joints_.set_up(std::span(jointed_bodies_).first(dynamics_.size()), dt_, steps_);
  const auto is_jointed = [&](std::size_t body) {
    return std::binary_search(jointed_.begin(), jointed_.end(), body);
  };
  for (Contacts::Patch& patch : patches_) patch.is_jointed = is_jointed(patch.a) || is_jointed(patch.b);
}

// Whether nobody else has changed a velocity since with_joints() set it.
bool NativeSolver::is_as_set(std::size_t place) const {
  if (is_same(contacts_.raw_motion(place), set_motions_[place])) return true;
  const Contacts::Motion now = contacts_.change(place);
  return now.linear == set_changes_[place].linear && now.angular == set_changes_[place].angular;
}

void NativeSolver::show_joints() {
  for (const std::size_t place : jointed_) {
    notes_[place].is_as_set = is_as_set(place);
    if (notes_[place].is_as_set) continue;
    const Contacts::Motion change = contacts_.change(place);
    linear_changes_[place] = change.linear;
    angular_changes_[place] = change.angular;
  }
}

void NativeSolver::with_joints(absl::FunctionRef<void()> act) {
  if (joints_.is_empty()) return;
  show_joints();
  act();
  for (const std::size_t place : jointed_) {
    const Contacts::Motion change{linear_changes_[place], angular_changes_[place]};
    Contacts::Motion& told = told_changes_[place];
    // Rounding moves what is told twice: what has not changed must not depend on other islands' turns.
    if (notes_[place].is_as_set && change.linear == told.linear && change.angular == told.angular) continue;
    told = change;
    contacts_.set_change(place, change);
    set_changes_[place] = contacts_.change(place);  // which rounding has moved
    set_motions_[place] = contacts_.raw_motion(place);
  }
}

// By what joints have made of the way and the turn of their bodies.
void NativeSolver::correct_jointed() {
  for (const joints::BodyMotion& moved : joints_.end()) {
    const auto place = static_cast<std::size_t>(moved.body);
    if (moved.angular) {
      const Eigen::Vector3d change = *moved.angular - bodies_[place].angular.cast<double>();
      contacts_.set_change(place, {contacts_.change(place).linear, change.cast<Scalar>()});
    }
    if (!moved.is_whole) {
      corrections_[place].linear += moved.way.cast<Scalar>();
      corrections_[place].angular += rotation_vector(moved.turn).cast<Scalar>();
      continue;
    }
    // Bodies move on by their final velocities, too.
    const Contacts::Body& body = bodies_[place];
    const Contacts::Motion change = contacts_.change(place);
    const Eigen::Vector3d linear = (body.linear + change.linear).cast<double>();
    const Eigen::Vector3d angular = (body.angular + change.angular).cast<double>();
    const Eigen::Quaterniond turn = rotation_by(angular * dt_).conjugate() * moved.turn;
    corrections_[place] = {(moved.way - linear * dt_).cast<Scalar>(), rotation_vector(turn).cast<Scalar>()};
  }
}

}  // namespace tessera::native
