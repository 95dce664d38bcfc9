// Contacts as rows, solved in small steps: contacts are found once a tick, forces act step by step, and
// impulses carry over from step to step and from tick to tick (Macklin et al., Small Steps in Physics
// Simulation, 2019). Overlaps open like an overdamped spring in the biased passes; a relaxed pass without
// that push ends each step, so that no velocity stays of it (Catto, Solver2D, 2024). A row for each point
// holds along the normal; friction is one two-dimensional block and one twisting row a patch, in the relaxed
// pass.
//
// Knows nothing of sectors, shapes or an engine: levers, normals, gaps and velocities are relative
// quantities, so the bodies of a patch may have been found near any origin. World axes; m, s, kg.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

namespace tessera {

inline constexpr std::size_t kPatchPointsMax = 4;

template <typename Scalar>
struct SolverTypes {
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;

  // A body for a tick. One that cannot be pushed has neither mass nor inertia here, only velocities.
  struct Body {
    Vector linear = Vector::Zero();           // m/s, of the centre of mass, before the tick
    Vector angular = Vector::Zero();          // rad/s
    Vector linear_force = Vector::Zero();     // m/s, what forces add to the velocity in the tick
    Vector angular_force = Vector::Zero();    // rad/s
    Scalar inverse_mass = 0;                  // 1/kg
    Matrix inverse_inertia = Matrix::Zero();  // 1/(kg m^2)
  };

  struct Point {
    Vector lever_a;  // m, from the centre of mass of a; of no meaning for a body that neither moves nor can
                     // be pushed
    Vector lever_b;
    Vector normal;       // unit length, pointing from b to a
    Scalar gap = 0;      // m, < 0 where the two overlap
    Scalar impulse = 0;  // N s, in the last tick; after it, in this one
  };

  // Points of two bodies that share friction: their normals differ little.
  struct Patch {
    std::size_t a = 0;  // places of the bodies
    std::size_t b = 0;
    Scalar friction = 0;
    Scalar restitution = 0;
    // A joint holds one of the bodies. Contacts and joints take turns, which converges slowly: friction then
    // acts in the biased passes, too.
    bool is_jointed = false;
    std::size_t points = 0;  // at most kPatchPointsMax
    Point point[kPatchPointsMax];
    Vector friction_impulse = Vector::Zero();  // N s, on a, in the last tick; after it, in this one
    Scalar twist_impulse = 0;                  // N m s, on a about the mean normal; likewise
  };
};

// One set of islands at a time: begin() with bodies and patches, in the order of solving; then for each of
// `steps` a start_step(), biased passes (pass(true)), advance(), a relaxed pass (pass(false)) and end_step();
// then rebound() and end(). What couples bodies by other means (joints) changes velocities in between.
template <typename Scalar>
class ContactSolver : public SolverTypes<Scalar> {
 public:
  using typename SolverTypes<Scalar>::Vector;
  using typename SolverTypes<Scalar>::Matrix;
  using typename SolverTypes<Scalar>::Body;
  using typename SolverTypes<Scalar>::Point;
  using typename SolverTypes<Scalar>::Patch;

  struct Options {
    Scalar time_step = 0;  // s, of the tick
    int steps = 4;         // >= 1
    // Of the settings: with more steps, contacts are stiffer by the square of the ratio.
    int usual_steps = 4;
    Scalar bounce_from = 0;  // m/s, the approach from which two bounce
  };

  void begin(const Options& options, std::span<const Body> bodies, std::span<const Patch> patches);
  void start_step();
  void pass(bool biased);
  void advance();
  void end_step();
  void rebound();

  // Impulses into `patches`, those of begin().
  void end(std::span<Patch> patches) const;

  // A body during the tick: the change of its velocities since before it, which is rounded less than the
  // velocities would be. `way` and `turn` (m, rad) are what corrected overlaps beyond the motion by the
  // velocities that stay: a body moves by them and by its final velocities, which conserves the energy of
  // falls and orbits.
  struct Moving {
    Vector linear;
    Vector angular;
    Vector way;
    Vector turn;
  };
  Moving& operator[](std::size_t body) { return moving_[body]; }
  const Moving& operator[](std::size_t body) const { return moving_[body]; }

 private:
  struct Side {
    Vector angular;   // lever x direction
    Vector response;  // of the angular velocity to a unit of impulse
  };
  struct NormalRow {
    Vector normal;
    Side a;
    Side b;
    Scalar mass = 0;
    Scalar start = 0;         // m/s, before the tick
    Scalar gap = 0;           // m, in this step
    Scalar approach_max = 0;  // m/s, at most 0: what closes the gap by the end of the tick
    Scalar rebound = 0;       // m/s, required if the two have touched
    Scalar impulse = 0;       // N s, of a step
    Scalar total = 0;         // of all steps
  };
  struct PatchRows {
    std::size_t a = 0;
    std::size_t b = 0;
    std::size_t first = 0;  // of its normal rows
    std::size_t count = 0;
    Scalar inverse_mass_a = 0;
    Scalar inverse_mass_b = 0;
    bool is_jointed = false;
    Scalar friction = 0;
    Scalar radius = 0;  // m, the mean distance of the points from their centre: the arm of the twist
    Vector normal;      // mean
    Vector tangent[2];
    Side tangent_a[2];
    Side tangent_b[2];
    Scalar start[2];  // m/s, along the tangents, before the tick
    Scalar mass[3];   // of the tangents: the inverse of a symmetric matrix (00, 01, 11)
    Vector twist_a;   // the response of a's angular velocity to a unit of twist
    Vector twist_b;
    Scalar twist_start = 0;  // rad/s
    Scalar twist_mass = 0;
    Scalar impulse[2] = {0, 0};  // of a step
    Scalar twist = 0;
    Scalar total[2] = {0, 0};
    Scalar twist_total = 0;
  };

  void add(const Patch& patch);
  void add_friction(const Patch& patch, PatchRows& rows) const;
  Side side(const Body& body, const Vector& lever, const Vector& direction) const;
  void push(const PatchRows& rows, const Vector& direction, const Side& a, const Side& b, Scalar impulse);
  void twist(const PatchRows& rows, Scalar impulse);
  void solve_normal(const PatchRows& rows, NormalRow& row, bool biased);
  void solve_friction(PatchRows& rows);

  Options options_;
  std::span<const Body> bodies_;
  Scalar step_ = 0;  // s
  // Of soft contacts.
  Scalar push_rate_ = 0;  // 1/s: velocity by overlap
  Scalar mass_share_ = 1;
  Scalar impulse_share_ = 0;
  std::vector<Moving> moving_;
  std::vector<PatchRows> patches_;
  std::vector<NormalRow> normals_;
};

extern template class ContactSolver<float>;
extern template class ContactSolver<double>;

}  // namespace tessera
