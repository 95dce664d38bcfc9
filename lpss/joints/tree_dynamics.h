// The dynamics of bodies that joints connect in a tree: M(q) a + bias(q, v) = efforts, where the armature of
// axes is part of M.
//
// Source: Featherstone, Rigid Body Dynamics Algorithms, 2008: the recursive Newton-Euler algorithm
// (table 5.1), the composite rigid body algorithm (table 6.2); here in the world's axes about one point
// (section 2.10). Joints of several degrees of freedom are chains of bodies without mass (section 4.4).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "lpss/joints/joint_form.h"

namespace tessera::joints {

// World axes; positions relative to one origin near all bodies.
struct TreeBody {
  double mass = 1;                                    // kg
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // kg m^2, about the centre of mass
  JointSide side;                                     // of the centre frame
  Eigen::Vector3d force = Eigen::Vector3d::Zero();    // N, at the centre of mass
};

// Bodies by their places in a list.
struct TreeJoint {
  const JointForm* form = nullptr;
  std::optional<std::size_t> inner;  // on which the other one hangs; none: the ground
  std::size_t outer = 0;             // which no joint before has
  bool outer_is_child = true;        // or it is the parent
};

// Degrees of freedom: of a body 0 that floats, the velocity of its centre of mass and its angular velocity,
// along the world's axes; then those of the joints in their order: rates of axes, or, of a ball joint, the
// angular velocity of the child relative to the parent, along the axes of the joint frame on the parent.
class TreeDynamics {
 public:
  // Each joint hangs on the ground or on a body that has come before; all bodies but one that floats hang on
  // one. `ground` is what the first joint hangs on, if that is no body: it keeps its velocities. Nothing is
  // kept of the arguments.
  TreeDynamics(std::span<const TreeBody> bodies, std::span<const TreeJoint> joints, const JointSide& ground);

  static std::size_t freedoms(JointType type);  // 0 to 3

  Eigen::Index freedoms() const { return velocities_.size(); }
  const Eigen::VectorXd& velocities() const { return velocities_; }

  // kg, kg m or kg m^2.
  Eigen::MatrixXd mass_matrix() const;

  // N or N m, at the degrees of freedom, for these accelerations: inverse dynamics. For 0, the bias: what
  // gravity, and forces that come with velocities, ask for.
  Eigen::VectorXd efforts(const Eigen::VectorXd& accelerations) const;

  // By degree of freedom, the velocity (world axes) of a point of a body and the body's angular velocity.
  // `point`: m, in its centre frame.
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(std::size_t body, const Eigen::Vector3d& point) const;

 private:
  // Angular, then linear: of what is at the origin. Forces likewise: moment about it, force.
  using Spatial = Eigen::Matrix<double, 6, 1>;
  using SpatialInertia = Eigen::Matrix<double, 6, 6>;

  static constexpr std::size_t kGround = ~std::size_t{0};
  static constexpr Eigen::Index kNoFreedom = -1;

  // A body, or one without mass between two axes of a joint, and the motion by which it hangs on another.
  struct Link {
    std::size_t inner = kGround;  // link
    Eigen::Index freedom = kNoFreedom;
    Spatial motion = Spatial::Zero();  // by a unit of its rate
    std::size_t carrier = kGround;     // the link in which `motion` stays as it is
    SpatialInertia inertia = SpatialInertia::Zero();
    Spatial force = Spatial::Zero();
    Spatial velocity = Spatial::Zero();
  };

  std::size_t add_link(std::size_t inner, Eigen::Index freedom, const Spatial& motion, double rate,
                       std::size_t carrier);
  void add_floating(const TreeBody& base);
  void add_joint(const TreeJoint& joint, const TreeBody& outer, const JointSide& inner, Eigen::Index first);
  void set_body(std::size_t body, const TreeBody& from);
  const Spatial& velocity_of(std::size_t link) const {
    return link == kGround ? ground_velocity_ : links_[link].velocity;
  }

  Eigen::Vector3d origin_;
  Spatial ground_velocity_ = Spatial::Zero();
  Spatial ground_acceleration_ = Spatial::Zero();
  std::vector<Link> links_;           // each after the one that it hangs on
  std::vector<std::size_t> link_of_;  // by body
  std::vector<Pose> poses_;           // of centre frames, relative to the origin
  Eigen::VectorXd velocities_;
  Eigen::VectorXd armature_;  // kg m^2 or kg, by degree of freedom
};

}  // namespace tessera::joints
