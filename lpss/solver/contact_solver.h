// Contacts as rows, solved in small steps: contacts are found once a tick, forces act step by step, and
// impulses carry over from step to step and from tick to tick (Macklin et al., Small Steps in Physics
// Simulation, 2019). Overlaps open like an overdamped spring in the biased passes; a relaxed pass without
// that push ends each step, so that no velocity stays of it (Catto, Solver2D, 2024). A row for each point
// holds along the normal; friction is one block of three rows a patch, two along the contact and the twist
// about its normal, which share one bound, in the relaxed pass.
//
// Knows nothing of sectors, shapes or an engine: levers, normals, gaps and velocities are relative
// quantities, so the bodies of a patch may have been found near any origin. World axes; m, s, kg.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lpss/base/parallel.h"
#include "lpss/solver/aligned_array.h"
#include "lpss/solver/contact_rows.h"
#include "lpss/solver/patch_groups.h"

namespace tessera {

inline constexpr std::size_t kPatchPointsMax = kRowPointsMax;

// Passes of a rebound. What several points do to several bodies is one thing, which takes some: those of a
// box that falls flat have settled to 1e-7 after one, a ball and two that it hits at once after five.
inline constexpr int kRebounds = 8;

template <typename Scalar>
struct SolverTypes {
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;

  // A body for a tick. One that cannot be pushed has neither mass nor inertia here, only velocities.
  struct Body {
    Vector linear = Vector::Zero();           // m/s, of the centre of mass, before the tick
    Vector angular = Vector::Zero();          // rad/s
    Vector linear_force = Vector::Zero();     // m/s, what forces add to the velocity in the tick
    Vector angular_force = Vector::Zero();    // rad/s; none about an axis without inverse inertia
    Scalar inverse_mass = 0;                  // 1/kg
    Matrix inverse_inertia = Matrix::Zero();  // 1/(kg m^2), symmetric
  };

  struct Point {
    Vector lever_a;  // m, from the centre of mass of a; of no meaning for a body that neither moves nor can
                     // be pushed
    Vector lever_b;
    Vector normal;       // unit length, pointing from b to a
    Scalar gap = 0;      // m, < 0 where the two overlap
    Scalar impulse = 0;  // N s, in the last tick; after it, in this one
  };

  // How a patch differs from one of usual surfaces, which are alike in all directions and stay with their
  // bodies.
  struct Surface {
    Vector direction = Vector::Zero();  // world axes; 0: shares are 1
    Scalar along = 1;                   // shares of the patch's friction, along the direction and across it
    Scalar across = 1;
    Vector drift = Vector::Zero();  // m/s, of the surface of a less that of b, beyond how the bodies move
    Scalar torsion = 0;             // m: the moment that resists twisting, by the normal force
    Scalar rolling = 0;             // m, that resists rolling, likewise
    Vector rolling_impulse = Vector::Zero();  // N m s, on a, in the last tick; after it, in this one
  };

  // How the surface of a moves past that of b over the tick, beyond what the velocities of the bodies say: of
  // a carrier that is accelerated or turns, which cannot be pushed. It changes evenly, step by step, so that
  // what rides on the carrier needs the same impulse in each.
  struct Course {
    Vector linear = Vector::Zero();          // m/s, at the centre of the patch's points, before the tick
    Vector angular = Vector::Zero();         // rad/s
    Vector linear_change = Vector::Zero();   // m/s, until the end of the tick
    Vector angular_change = Vector::Zero();  // rad/s
  };

  // Points of two bodies that share friction: their normals differ little.
  struct Patch {
    std::size_t a = 0;  // places of the bodies
    std::size_t b = 0;
    Scalar friction = 0;
    Scalar restitution = 0;
    // A joint holds one of the bodies: solved elsewhere, by what knows joints, and left out here.
    bool is_jointed = false;
    double mobility = 0;  // 1/kg, after end(): by what a unit of impulse at a jointed one's points moves both
    std::size_t points = 0;  // at most kPatchPointsMax
    Point point[kPatchPointsMax];
    Vector friction_impulse = Vector::Zero();  // N s, on a, in the last tick; after it, in this one
    Scalar twist_impulse = 0;                  // N m s, on a about the mean normal; likewise
    Surface* surface = nullptr;                // none: usual ones
    // None: the surfaces move as the bodies do. On a carrier with a course, friction acts in the biased
    // passes, too, so that a jerk finds no slip.
    const Course* course = nullptr;
  };
};

// One set of islands at a time: begin() with bodies and patches, in the order of solving; then for each of
// `steps` a start_step(), biased passes (pass(true)), advance(), a relaxed pass (pass(false)) and end_step();
// then kRebounds times rebound(), and end(). What couples bodies by other means (joints) changes velocities
// in between. Passes and rebounds may be divided into stages: what pushes bodies elsewhere sets their motions
// before a stage.
//
// Patches are solved several at a time, in lanes, as if one after the other: each waits for those before it
// that push one of its bodies. Many patches are solved on several threads in the same way: wave by wave, of
// groups that share no body. The number of lanes and of threads changes no bit.
template <typename Scalar>
class ContactSolver : public SolverTypes<Scalar> {
 public:
  using typename SolverTypes<Scalar>::Vector;
  using typename SolverTypes<Scalar>::Matrix;
  using typename SolverTypes<Scalar>::Body;
  using typename SolverTypes<Scalar>::Point;
  using typename SolverTypes<Scalar>::Patch;
  using typename SolverTypes<Scalar>::Course;

  struct Options {
    Scalar time_step = 0;  // s, of the tick
    int steps = 4;         // >= 1
    // Of the settings: with more steps, contacts are stiffer by the square of the ratio.
    int usual_steps = 4;
    // Two bounce that meet faster than forces make one of them in so many ticks ...
    Scalar bounce_from = 0;
    Scalar bounce_from_min = 0;             // m/s, ... and than this
    int lanes = 0;                          // one of widths(), or 0: what suits processor and patches
    const ParallelFor* parallel = nullptr;  // for so many patches that it pays; outlives end()
  };

  // The numbers of lanes that this processor has, ascending from 1.
  static std::span<const int> widths();

  // The spans stay valid and unchanged until end(). `bodies` are fewer than 2^31. Each stage ends after so
  // many patches; the last one after all.
  void begin(const Options& options, std::span<const Body> bodies, std::span<const Patch> patches,
             std::span<const std::size_t> stage_ends);
  void begin(const Options& options, std::span<const Body> bodies, std::span<const Patch> patches) {
    begin(options, bodies, patches, std::array{patches.size()});
  }
  void start_step();
  void pass(bool biased, std::size_t stage = 0);
  void advance();
  void end_step();
  void rebound(std::size_t stage = 0);
  // False: rebounds change nothing, here or elsewhere, unless what is coupled by other means does.
  bool may_bounce() const { return may_bounce_; }

  // Impulses into `patches`, those of begin().
  void end(std::span<Patch> patches) const;

  // How soft contacts are in this tick, and how long its steps (see ContactRows): for who solves those of
  // jointed bodies.
  const ContactRows<Scalar>& softness() const { return rows_; }
  // m/s: the approach from which the points of a patch bounce.
  Scalar bounce_from(const Patch& patch) const;

  struct Motion {
    Vector linear;
    Vector angular;
  };

  // The change of a body's velocities since before the tick (m/s, rad/s), which is rounded less than the
  // velocities would be. Setting what change() gives changes no bit.
  Motion change(std::size_t body) const;
  void set_change(std::size_t body, const Motion& change);

  // How a body moves at this moment, and moved when the step advanced, as the solver has it: for a solver
  // with the same body (inverse mass and inertia) elsewhere. The numbers of another body are of no meaning.
  const RowBody<Scalar>& raw_motion(std::size_t body) const { return moving_[body]; }
  const RowBody<Scalar>& raw_advance(std::size_t body) const { return advanced_[body]; }
  void set_raw_motion(std::size_t body, const RowBody<Scalar>& motion) { moving_[body] = motion; }
  void set_raw_advance(std::size_t body, const RowBody<Scalar>& motion) { advanced_[body] = motion; }

  // What corrected overlaps beyond the motion by the velocities that stay (m, rad), less the way of what they
  // changed by in rebounds: a body that bounces ends the tick where it touches. A body moves by this and by
  // its final velocities, which conserves the energy of falls and orbits.
  Motion correction(std::size_t body) const;

 private:
  void begin_body(std::size_t n);
  void begin_patches(std::span<const Patch> patches, std::span<const std::size_t> stage_ends);
  void group_patches(std::span<const Patch> patches, std::span<const std::size_t> stage_ends);
  void find_waves(std::span<const Patch> patches);
  void begin_group(std::size_t group, std::span<const Patch> patches);
  // Of the patches of a group; null if all are usual.
  const SurfaceLanes<Scalar>* surfaces_of(std::size_t group, std::span<const Patch> patches,
                                          SurfaceLanes<Scalar>& lanes) const;
  void begin_courses(std::span<const Patch> patches);
  void end_group(std::size_t group, std::span<Patch> patches) const;
  template <typename Act>
  void for_each_body(const Act& act) const;
  const ContactPasses<Scalar>& passes() const { return has_surfaces_ ? kernel_->with_grips : kernel_->usual; }
  void run(void (*act)(const ContactRows<Scalar>&), std::size_t stage) const;
  Vector unscaled(std::size_t body, const Scalar* angular) const;

  Options options_;
  std::span<const Body> bodies_;
  bool may_bounce_ = false;
  bool has_surfaces_ = false;  // a patch has one of its own
  bool has_courses_ = false;
  const ContactKernel<Scalar>* kernel_ = nullptr;
  ContactRows<Scalar> rows_{};
  PatchGroups groups_;
  std::vector<std::uint8_t> points_;    // by group: of its patch of most
  std::vector<std::size_t> first_row_;  // by group
  const ParallelFor* parallel_ = nullptr;
  std::vector<std::size_t> stages_;  // where they begin, and the end of the last one, in groups
  // Where the waves begin, and the end of the last one: groups in a row that share no body but `still`.
  std::vector<std::size_t> waves_;
  std::vector<std::size_t> first_wave_;  // by stage, and the number of all
  std::vector<std::size_t> wave_of_;     // by body: the last wave that pushes it
  // What courses add in a step, by group; of those with one.
  std::vector<std::pair<std::size_t, CourseLanes<Scalar>>> courses_;
  // By body; one more in `moving_`, `forces_` and `advanced_`, for all that cannot be pushed.
  AlignedArray<RowBodyTerms<Scalar>> terms_;
  AlignedArray<RowBody<Scalar>> moving_;
  AlignedArray<RowBody<Scalar>> forces_;      // in a step
  AlignedArray<RowBody<Scalar>> advanced_;    // moving_, as bodies move in a step, or before they rebound
  AlignedArray<RowBody<Scalar>> correction_;  // m, and rad in scaled axes
  // Laid out by the kernel.
  AlignedArray<std::byte> group_storage_;
  AlignedArray<std::byte> friction_storage_;
  AlignedArray<std::byte> grip_storage_;
  AlignedArray<std::byte> row_storage_;
};

extern template class ContactSolver<float>;
extern template class ContactSolver<double>;

}  // namespace tessera
