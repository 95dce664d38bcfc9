#include "lpss/joints/tree_dynamics.h"

#include <array>

namespace tessera::joints {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Spatial = Eigen::Matrix<double, 6, 1>;

Spatial spatial(const Vector3d& angular, const Vector3d& linear) {
  Spatial joined;
  joined << angular, linear;
  return joined;
}

// Of a body that turns at `angular` and of which the point `at` moves at `linear`.
Spatial motion_at(const Vector3d& at, const Vector3d& angular, const Vector3d& linear) {
  return spatial(angular, linear - angular.cross(at));
}

// Featherstone, eq. 2.31 and 2.32.
Spatial cross_motion(const Spatial& velocity, const Spatial& motion) {
  const Vector3d w = velocity.head<3>();
  return spatial(w.cross(motion.head<3>()),
                 w.cross(motion.tail<3>()) + Vector3d(velocity.tail<3>()).cross(motion.head<3>()));
}
Spatial cross_force(const Spatial& velocity, const Spatial& force) {
  const Vector3d w = velocity.head<3>();
  return spatial(w.cross(force.head<3>()) + Vector3d(velocity.tail<3>()).cross(force.tail<3>()),
                 w.cross(force.tail<3>()));
}

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// How a link moves on the one before it.
struct Freedom {
  int number;  // of the joint
  Spatial motion;
  double rate;
};

struct Freedoms {
  std::array<Freedom, 3> of{};
  std::size_t count = 0;

  void add(const Spatial& motion, double rate) {
    of[count] = {static_cast<int>(count), motion, rate};
    ++count;
  }
};

// Of the child, as seen from the parent: the first turns with the parent.
Freedoms freedoms_of(const JointForm& form, const JointSide& parent, const JointSide& child,
                     const Vector3d& origin) {
  const Pose at = parent.pose * form.in_parent;
  const Vector3d point = at.position - origin;
  const Vector3d x = at.orientation * Vector3d::UnitX();
  const Vector3d still = Vector3d::Zero();
  const JointState state = joint_state(form, parent, child);
  Freedoms freedoms;
  switch (form.type) {
    case JointType::kFixed:
      break;
    case JointType::kRevolute:
      freedoms.add(motion_at(point, x, still), state.velocity[0]);
      break;
    case JointType::kPrismatic:
      freedoms.add(spatial(still, x), state.velocity[0]);
      break;
    case JointType::kScrew:
      freedoms.add(motion_at(point, x, form.pitch * x), state.velocity[0]);
      break;
    case JointType::kUniversal: {
      const Vector3d y = (child.pose.orientation * form.in_child.orientation) * Vector3d::UnitY();
      freedoms.add(motion_at(point, x, still), state.velocity[0]);
      freedoms.add(motion_at(point, y, still), state.velocity[1]);
      break;
    }
    case JointType::kBall: {
      const Vector3d rate = at.orientation.conjugate() * (child.angular_velocity - parent.angular_velocity);
      for (int k = 0; k < 3; ++k)
        freedoms.add(motion_at(point, at.orientation * Vector3d::Unit(k), still), rate[k]);
      break;
    }
  }
  return freedoms;
}

}  // namespace

std::size_t TreeDynamics::freedoms(JointType type) {
  return type == JointType::kBall ? 3 : static_cast<std::size_t>(axis_count(type));
}

TreeDynamics::TreeDynamics(std::span<const TreeBody> bodies, std::span<const TreeJoint> joints,
                           const JointSide& ground)
    : origin_(bodies.front().side.pose.position), link_of_(bodies.size()), poses_(bodies.size()) {
  const bool floats = joints.empty() || joints.front().inner.has_value();
  Index count = floats ? 6 : 0;
  for (const TreeJoint& joint : joints) count += static_cast<Index>(freedoms(joint.form->type));
  velocities_.setZero(count);
  armature_.setZero(count);
  if (floats) {
    add_floating(bodies.front());
  } else {
    const Vector3d at = ground.pose.position - origin_;
    ground_velocity_ = motion_at(at, ground.angular_velocity, ground.linear_velocity);
    // Its centre goes on at the same velocity, so that what is at the origin does not.
    ground_acceleration_ = spatial(Vector3d::Zero(), -ground.angular_velocity.cross(ground.linear_velocity));
  }
  Index first = floats ? 6 : 0;
  for (const TreeJoint& joint : joints) {
    const TreeBody& outer = bodies[joint.outer];
    add_joint(joint, outer, joint.inner ? bodies[*joint.inner].side : ground, first);
    set_body(joint.outer, outer);
    Index freedom = first;
    for (const JointAxis& axis : axes_of(*joint.form)) armature_[freedom++] = axis.armature;
    first += static_cast<Index>(freedoms(joint.form->type));
  }
}

std::size_t TreeDynamics::add_link(std::size_t inner, Index freedom, const Spatial& motion, double rate,
                                   std::size_t carrier) {
  Link link;
  link.inner = inner;
  link.freedom = freedom;
  link.motion = motion;
  link.carrier = carrier;
  link.velocity = velocity_of(inner) + motion * rate;
  if (freedom != kNoFreedom) velocities_[freedom] = rate;
  links_.push_back(link);
  return links_.size() - 1;
}

// Its centre of mass, which is at the origin, moves along the world's axes, and it turns about that.
void TreeDynamics::add_floating(const TreeBody& base) {
  const Vector3d still = Vector3d::Zero();
  std::size_t link = kGround;
  for (int k = 0; k < 3; ++k)
    link = add_link(link, k, spatial(still, Vector3d::Unit(k)), base.side.linear_velocity[k], kGround);
  const std::size_t carrier = link;
  for (int k = 0; k < 3; ++k)
    link = add_link(link, 3 + k, spatial(Vector3d::Unit(k), still), base.side.angular_velocity[k], carrier);
  set_body(0, base);
}

void TreeDynamics::add_joint(const TreeJoint& joint, const TreeBody& outer, const JointSide& inner,
                             Index first) {
  const JointSide& parent = joint.outer_is_child ? inner : outer.side;
  const JointSide& child = joint.outer_is_child ? outer.side : inner;
  const Freedoms freedoms = freedoms_of(*joint.form, parent, child, origin_);
  const std::size_t base = joint.inner ? link_of_[*joint.inner] : kGround;
  std::size_t link = base;
  for (std::size_t n = 0; n < freedoms.count; ++n) {
    const Freedom& freedom = freedoms.of[joint.outer_is_child ? n : freedoms.count - 1 - n];
    const double sign = joint.outer_is_child ? 1 : -1;
    link = add_link(link, first + freedom.number, sign * freedom.motion, freedom.rate, link);
  }
  if (freedoms.count == 0) link = add_link(link, kNoFreedom, Spatial::Zero(), 0, kGround);
  if (joint.form->type != JointType::kBall) return;
  // All three of its axes are those of the parent.
  for (std::size_t n = link; n != base; n = links_[n].inner)
    links_[n].carrier = joint.outer_is_child ? base : link;
}

// Of the last link.
void TreeDynamics::set_body(std::size_t body, const TreeBody& from) {
  link_of_[body] = links_.size() - 1;
  poses_[body] = from.side.pose;
  poses_[body].position -= origin_;
  Link& link = links_.back();
  const Matrix3d at = cross_matrix(poses_[body].position);
  // Featherstone, eq. 2.63.
  link.inertia << from.inertia + from.mass * at * at.transpose(), from.mass * at, from.mass * at.transpose(),
      from.mass * Matrix3d::Identity();
  link.force = spatial(poses_[body].position.cross(from.force), from.force);
}

Eigen::MatrixXd TreeDynamics::mass_matrix() const {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(freedoms(), freedoms());
  std::vector<SpatialInertia> composite;
  composite.reserve(links_.size());
  for (const Link& link : links_) composite.push_back(link.inertia);
  for (std::size_t n = links_.size(); n-- > 0;) {
    const Link& link = links_[n];
    if (link.inner != kGround) composite[link.inner] += composite[n];
    if (link.freedom == kNoFreedom) continue;
    const Spatial force = composite[n] * link.motion;
    for (std::size_t k = n; k != kGround; k = links_[k].inner) {
      const Link& other = links_[k];
      if (other.freedom == kNoFreedom) continue;
      matrix(link.freedom, other.freedom) = matrix(other.freedom, link.freedom) = force.dot(other.motion);
    }
  }
  matrix.diagonal() += armature_;
  return matrix;
}

Eigen::VectorXd TreeDynamics::efforts(const Eigen::VectorXd& accelerations) const {
  std::vector<Spatial> acceleration(links_.size());
  std::vector<Spatial> force(links_.size());
  for (std::size_t n = 0; n < links_.size(); ++n) {
    const Link& link = links_[n];
    acceleration[n] = link.inner == kGround ? ground_acceleration_ : acceleration[link.inner];
    if (link.freedom != kNoFreedom) {
      acceleration[n] += link.motion * accelerations[link.freedom] +
                         cross_motion(velocity_of(link.carrier), link.motion) * velocities_[link.freedom];
    }
    force[n] = link.inertia * acceleration[n] +
               cross_force(link.velocity, Spatial(link.inertia * link.velocity)) - link.force;
  }
  Eigen::VectorXd efforts(freedoms());
  for (std::size_t n = links_.size(); n-- > 0;) {
    const Link& link = links_[n];
    if (link.freedom != kNoFreedom) efforts[link.freedom] = link.motion.dot(force[n]);
    if (link.inner != kGround) force[link.inner] += force[n];
  }
  efforts += armature_.cwiseProduct(accelerations);
  return efforts;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> TreeDynamics::jacobian(std::size_t body,
                                                                const Vector3d& point) const {
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian;
  jacobian.setZero(6, freedoms());
  const Vector3d at = poses_[body] * point;
  for (std::size_t n = link_of_[body]; n != kGround; n = links_[n].inner) {
    const Link& link = links_[n];
    if (link.freedom == kNoFreedom) continue;
    const Vector3d angular = link.motion.head<3>();
    jacobian.col(link.freedom) << link.motion.tail<3>() + angular.cross(at), angular;
  }
  return jacobian;
}

}  // namespace tessera::joints
