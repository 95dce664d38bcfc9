// Islands as arrays of numbers: what their solver takes, and what it leaves of them.
//
// All is relative: a contact has lever arms, normals and gaps, and a joint the way from one of its sectors to
// the other. So bodies and contacts may have been found near any origins, in this process or elsewhere.
// World axes; m, s, kg.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lpss/base/divergence_kind.h"
#include "lpss/joints/island_joint.h"
#include "lpss/joints/joint_loads.h"
#include "lpss/solver/contact_solver.h"

namespace tessera {

// One set of islands, or of parts of islands, that take the same number of steps. Keeps its storage.
template <typename Scalar>
struct Islands {
  using Vector = typename SolverTypes<Scalar>::Vector;
  using Matrix = typename SolverTypes<Scalar>::Matrix;
  using Body = typename SolverTypes<Scalar>::Body;
  using Patch = typename SolverTypes<Scalar>::Patch;
  using Surface = typename SolverTypes<Scalar>::Surface;
  using Course = typename SolverTypes<Scalar>::Course;

  // Where a dynamic body is at the start of the tick; what joints look at.
  struct Frame {
    Matrix rotation;
    Vector position;         // m, from the centre of its sector
    Vector moments;          // kg m^2, principal
    Vector inverse_moments;  // 1/(kg m^2)
    bool may_fly = false;    // if nothing but joints holds its island
  };

  // A pair of bodies, with patches in a row.
  struct Contact {
    std::size_t first = 0;  // patch
    std::size_t patches = 0;
    bool may_bounce = false;
  };

  // What the solver leaves of a dynamic body, which then moves on by its new velocities.
  struct Solved {
    Vector linear = Vector::Zero();   // m/s, the change of its velocities
    Vector angular = Vector::Zero();  // rad/s
    Vector way = Vector::Zero();      // m, rad: what corrects its pose beyond its motion
    Vector turn = Vector::Zero();
    bool is_pushed = false;   // by contacts and joints; otherwise it is in free flight
    bool is_buried = false;   // in something
    bool is_carried = false;  // by a surface that moves
    // s, half a step, if its island flies (Frame::may_fly), else 0. In steps, a body that an acceleration
    // moves goes too far by that times the tick times this.
    Scalar overshoot = 0;

    // Whether that leads somewhere, and no farther than any body goes in `dt` seconds.
    bool is_within_bounds(double dt) const {
      const double most = kSpeedMax * dt;
      return way.template cast<double>().squaredNorm() <= most * most && turn.allFinite();
    }
  };

  // First the dynamic ones; then one for all that neither moves nor can be pushed; then kinematic ones.
  std::vector<Body> bodies;
  std::size_t dynamics = 0;
  std::vector<Frame> frames;      // of dynamic bodies, if there are joints
  std::vector<Solved> solved;     // of dynamic bodies; before, what is known of their contacts
  std::vector<Contact> contacts;  // in the order of solving
  std::vector<Patch> patches;
  std::vector<Surface> surfaces;  // of patches, which refer to them
  std::vector<Course> courses;    // likewise
  std::vector<IslandJoint> joints;
  std::vector<JointLoads> joint_loads;  // of these, once they are solved

  std::size_t fixed() const { return dynamics; }
};

}  // namespace tessera
