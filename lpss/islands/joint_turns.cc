#include "lpss/islands/joint_turns.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "lpss/base/divergence_kind.h"
#include "lpss/base/rotation.h"

namespace tessera {
namespace {

template <typename Scalar>
SolverTypes<double>::Body in_double(const typename SolverTypes<Scalar>::Body& body) {
  return {.linear = body.linear.template cast<double>(),
          .angular = body.angular.template cast<double>(),
          .linear_force = body.linear_force.template cast<double>(),
          .angular_force = body.angular_force.template cast<double>(),
          .inverse_mass = double(body.inverse_mass),
          .inverse_inertia = body.inverse_inertia.template cast<double>()};
}

template <typename Scalar>
SolverTypes<double>::Surface in_double(const typename SolverTypes<Scalar>::Surface& surface) {
  return {.direction = surface.direction.template cast<double>(),
          .along = double(surface.along),
          .across = double(surface.across),
          .drift = surface.drift.template cast<double>(),
          .torsion = double(surface.torsion),
          .rolling = double(surface.rolling),
          .rolling_impulse = surface.rolling_impulse.template cast<double>()};
}

template <typename Scalar>
SolverTypes<double>::Course in_double(const typename SolverTypes<Scalar>::Course& course) {
  return {.linear = course.linear.template cast<double>(),
          .angular = course.angular.template cast<double>(),
          .linear_change = course.linear_change.template cast<double>(),
          .angular_change = course.angular_change.template cast<double>()};
}

// But for its surface and course.
template <typename Scalar>
SolverTypes<double>::Patch in_double(const typename SolverTypes<Scalar>::Patch& patch) {
  SolverTypes<double>::Patch copy;
  copy.a = patch.a;
  copy.b = patch.b;
  copy.friction = double(patch.friction);
  copy.restitution = double(patch.restitution);
  copy.points = patch.points;
  for (std::size_t n = 0; n < patch.points; ++n) {
    const auto& point = patch.point[n];
    copy.point[n] = {.lever_a = point.lever_a.template cast<double>(),
                     .lever_b = point.lever_b.template cast<double>(),
                     .normal = point.normal.template cast<double>(),
                     .gap = double(point.gap),
                     .impulse = double(point.impulse)};
  }
  copy.friction_impulse = patch.friction_impulse.template cast<double>();
  copy.twist_impulse = double(patch.twist_impulse);
  return copy;
}

}  // namespace

template <typename Scalar>
JointSide JointTurns<Scalar>::side_of(std::size_t place) const {
  const auto& frame = islands_->frames[place];
  const auto& body = islands_->bodies[place];
  return {{frame.position.template cast<double>(),
           Eigen::Quaterniond(frame.rotation.template cast<double>()).normalized()},
          body.linear.template cast<double>(),
          body.angular.template cast<double>()};
}

template <typename Scalar>
joints::SolvedJoint JointTurns<Scalar>::solved_joint(const IslandJoint& joint) const {
  std::optional<int> pushed;
  std::optional<JointSide> parent;
  if (joint.has_parent()) {
    pushed = static_cast<int>(joint.parent);
    parent = side_of(joint.parent);
  }
  return {joint.id,     static_cast<int>(joint.child),
          pushed,       joint.form,
          joint.drives, joints::posed(joint, side_of(joint.child), parent)};
}

template <typename Scalar>
void JointTurns<Scalar>::begin(Islands<Scalar>& islands, double dt, int steps) {
  joints_.clear();
  jointed_.clear();
  jointed_contacts_.clear();
  islands_ = &islands;
  dt_ = dt;
  if (islands.joints.empty()) return;
  for (const IslandJoint& joint : islands.joints) {
    joints_.add(solved_joint(joint));
    // What is fixed to the ground stays in it.
    if (!joint.has_parent() && joint.form->type == JointType::kFixed)
      islands.solved[joint.child].is_buried = false;
  }
  const std::span<const std::size_t> jointed = joints_.bodies();
  jointed_.assign(jointed.begin(), jointed.end());
  if (bodies_.size() < islands.dynamics) bodies_.resize(islands.dynamics);
  for (const std::size_t place : jointed_) {
    islands.solved[place].is_pushed = true;
    const auto& body = islands.bodies[place];
    const auto& frame = islands.frames[place];
    bodies_[place] = {.inverse_mass = body.inverse_mass,
                      .inverse_inertia = tensor_along(frame.rotation, frame.inverse_moments),
                      .inverse_moments = frame.inverse_moments.template cast<double>(),
                      .linear = body.linear.template cast<double>(),
                      .angular = body.angular.template cast<double>(),
                      .linear_force = body.linear_force.template cast<double>(),
                      .angular_force = body.angular_force.template cast<double>()};
  }
  joints_.set_up(std::span(bodies_).first(islands.dynamics), dt, steps);
  const auto is_jointed = [&](std::size_t body) { return std::ranges::binary_search(jointed_, body); };
  for (auto& patch : islands.patches) patch.is_jointed = is_jointed(patch.a) || is_jointed(patch.b);
}

template <typename Scalar>
void JointTurns<Scalar>::begin(Contacts& contacts) {
  contacts_ = &contacts;
  if (!is_empty()) begin_jointed_contacts();
}

template <typename Scalar>
void JointTurns<Scalar>::begin_jointed_contacts() {
  patches_.clear();
  surfaces_.resize(islands_->surfaces.size());
  courses_.resize(islands_->courses.size());
  if (touched_.size() < islands_->bodies.size()) touched_.resize(islands_->bodies.size());
  for (std::size_t n = 0; n < islands_->patches.size(); ++n) {
    const auto& patch = islands_->patches[n];
    if (!patch.is_jointed) continue;
    JointedContacts::Given& given = patches_.emplace_back();
    given.patch = in_double<Scalar>(patch);
    given.place = n;
    given.bounce_from = double(contacts_->bounce_from(patch));
    if (patch.surface) {
      auto& surface = surfaces_[static_cast<std::size_t>(patch.surface - islands_->surfaces.data())];
      surface = in_double<Scalar>(*patch.surface);
      given.patch.surface = &surface;
    }
    if (patch.course) {
      auto& course = courses_[static_cast<std::size_t>(patch.course - islands_->courses.data())];
      course = in_double<Scalar>(*patch.course);
      given.patch.course = &course;
    }
    for (const std::size_t place : {patch.a, patch.b})
      touched_[place] = in_double<Scalar>(islands_->bodies[place]);
  }
  const ContactRows<Scalar>& rows = contacts_->softness();
  const JointedContacts::Softness softness{.time_step = double(rows.time_step),
                                           .share = double(rows.share),
                                           .step = double(rows.step),
                                           .push_rate = double(rows.push_rate),
                                           .impulse_share = double(rows.impulse_share),
                                           .mass_share = double(rows.mass_share)};
  jointed_contacts_.begin(softness, joints_, *this, std::span(touched_).first(islands_->bodies.size()),
                          jointed_, patches_);
}

template <typename Scalar>
FreeBodies::Velocities JointTurns<Scalar>::change(std::size_t place) const {
  const auto change = contacts_->change(place);
  Velocities velocities;
  velocities << change.linear.template cast<double>(), change.angular.template cast<double>();
  return velocities;
}

template <typename Scalar>
void JointTurns<Scalar>::push(std::size_t place, const Velocities& push) {
  const Velocities now = change(place) + push;
  contacts_->set_change(place, {now.template head<3>().template cast<Scalar>(),
                                now.template tail<3>().template cast<Scalar>()});
}

// What bodies on joints bear is known only once these have answered for it: at rest, a step then changes
// nothing.
template <typename Scalar>
void JointTurns<Scalar>::start_step() {
  joints_.start_step();
  jointed_contacts_.start_step();
  joints_.pass();
  jointed_contacts_.settle();
  joints_.pass_if_pushed();
}

// The contacts of jointed bodies have settled already, which was their first turn of the step.
template <typename Scalar>
void JointTurns<Scalar>::after_first_pass() {
  joints_.pass_untouched();
}

template <typename Scalar>
void JointTurns<Scalar>::after_pass(bool relaxed) {
  if (relaxed) {
    jointed_contacts_.relax();
  } else {
    jointed_contacts_.open();
  }
  hold();
}

template <typename Scalar>
void JointTurns<Scalar>::hold() {
  joints_.pass();
}

template <typename Scalar>
void JointTurns<Scalar>::rebound(bool is_first) {
  jointed_contacts_.rebound();
  if (is_first) return hold();
  joints_.pass_if_pushed();
}

template <typename Scalar>
void JointTurns<Scalar>::advance() {
  jointed_contacts_.note_velocities();
  joints_.move();
}

template <typename Scalar>
void JointTurns<Scalar>::end_step() {
  jointed_contacts_.note_velocities();
  joints_.end_step();
}

template <typename Scalar>
void JointTurns<Scalar>::write_impulses() {
  jointed_contacts_.end(patches_);
  for (const JointedContacts::Given& given : patches_) {
    auto& patch = islands_->patches[given.place];
    patch.mobility = given.patch.mobility;
    for (std::size_t n = 0; n < patch.points; ++n)
      patch.point[n].impulse = Scalar(given.patch.point[n].impulse);
    patch.friction_impulse = given.patch.friction_impulse.template cast<Scalar>();
    patch.twist_impulse = Scalar(given.patch.twist_impulse);
    if (patch.surface)
      patch.surface->rolling_impulse = given.patch.surface->rolling_impulse.template cast<Scalar>();
  }
}

template <typename Scalar>
void JointTurns<Scalar>::write_loads() {
  std::vector<JointLoads>& loads = islands_->joint_loads;
  loads.resize(islands_->joints.size());
  joints_.write_impulses(loads);
  for (JointLoads& of : loads) {
    for (double& effort : of.effort) effort /= dt_;
    for (double& force : of.force) force /= dt_;
    for (double& torque : of.torque) torque /= dt_;
  }
}

template <typename Scalar>
void JointTurns<Scalar>::end() {
  if (is_empty()) return;
  write_impulses();
  for (const joints::BodyMotion& moved : joints_.end()) {
    const auto place = static_cast<std::size_t>(moved.body);
    const auto& body = islands_->bodies[place];
    auto& solved = islands_->solved[place];
    solved.linear = (moved.linear - body.linear.template cast<double>()).template cast<Scalar>();
    solved.angular = (moved.angular - body.angular.template cast<double>()).template cast<Scalar>();
    if (!moved.is_whole) {
      solved.way = moved.way.template cast<Scalar>();
      solved.turn = rotation_vector(moved.turn).template cast<Scalar>();
      continue;
    }
    // Bodies move on by their final velocities, too.
    const Eigen::Vector3d linear = (body.linear + solved.linear).template cast<double>();
    const Eigen::Vector3d angular = (body.angular + solved.angular).template cast<double>();
    const Eigen::Quaterniond turn = rotation_by(angular * dt_).conjugate() * moved.turn;
    solved.way = (moved.way - linear * dt_).template cast<Scalar>();
    solved.turn = rotation_vector(turn).template cast<Scalar>();
  }
  write_loads();
}

// Or may have, where it turns fast: who hosts it decides, by its size.
template <typename Scalar>
bool JointTurns<Scalar>::has_diverged(std::size_t place) const {
  const auto& body = islands_->bodies[place];
  const auto& solved = islands_->solved[place];
  if (!solved.is_within_bounds(dt_)) return true;
  constexpr double kOfAnySize = std::numeric_limits<double>::infinity();
  const Vector linear = body.linear + solved.linear;
  const Vector angular = body.angular + solved.angular;
  return divergence_of(linear.template cast<double>(), angular.template cast<double>(), kOfAnySize)
      .has_value();
}

template <typename Scalar>
Pose JointTurns<Scalar>::pose_after(std::size_t place) const {
  Pose pose = side_of(place).pose;
  const auto& solved = islands_->solved[place];
  if (!solved.is_within_bounds(dt_)) return pose;
  pose.position += solved.way.template cast<double>();
  pose.orientation = rotation_by(solved.turn.template cast<double>()) * pose.orientation;
  return pose;
}

// m: how far the child is from where the joint would have it.
template <typename Scalar>
double JointTurns<Scalar>::error_of(const IslandJoint& joint) const {
  const JointForm& form = *joint.form;
  const JointSide child{pose_after(joint.child)};
  JointSide parent;
  if (joint.has_parent()) {
    parent.pose = pose_after(joint.parent);
    parent.pose.position += joint.parent_origin;
  } else {
    parent.pose = joint.fixed_parent * form.in_parent.inverse();
  }
  const JointState state = joint_state(form, parent, child);
  return state.gap + state.twist * form.in_child.position.norm();
}

template <typename Scalar>
void JointTurns<Scalar>::find_blamed(std::vector<BlamedJoint>& blamed) const {
  blamed.clear();
  std::map<std::size_t, std::pair<double, std::size_t>> worst;  // by body
  for (std::size_t n = 0; n < islands_->joints.size(); ++n) {
    const IslandJoint& joint = islands_->joints[n];
    const bool child = has_diverged(joint.child);
    const bool parent = joint.has_parent() && has_diverged(joint.parent);
    if (!child && !parent) continue;
    const double error = error_of(joint);
    const auto blame = [&](std::size_t body) {
      const auto [known, is_new] = worst.try_emplace(body, error, n);
      if (!is_new && error > known->second.first) known->second = {error, n};
    };
    if (child) blame(joint.child);
    if (parent) blame(joint.parent);
  }
  for (const auto& [body, worst_joint] : worst) blamed.push_back({body, worst_joint.second});
}

template class JointTurns<float>;
template class JointTurns<double>;

}  // namespace tessera
