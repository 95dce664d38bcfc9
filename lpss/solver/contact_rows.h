// The inner loops of the contact solver over rows in lanes: every kernel runs the same sequence of operations
// a patch, in 1, 2, 4 or 8 lanes, so that the number of lanes changes no bit. Without Eigen and without
// inline functions: kernels are compiled for different processors, and must not share code.
//
// Rows keep angular quantities in scaled axes. With the inverse inertia as C C^T, C lower triangular, and an
// angular velocity as C u, a lever arm crossed with a direction, r x n, has s = C^T (r x n) as its row for u,
// and as its response to a unit of impulse: one vector where there would be two.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

inline constexpr int kRowLanesMax = 8;
inline constexpr int kRowPointsMax = 4;

// m: the arm of a twist is no longer, however little friction there is beside torsion.
inline constexpr double kTwistArmMax = 1e6;

// A body in the loop: whole registers.
template <typename Scalar>
struct alignas(8 * sizeof(Scalar)) RowBody {
  Scalar linear[3];  // m/s, the change since before the tick
  Scalar inverse_mass;
  Scalar angular[3];  // likewise, in scaled axes
  Scalar unused;
};

// A body as rows are set up.
template <typename Scalar>
struct alignas(8 * sizeof(Scalar)) RowBodyTerms {
  Scalar linear[3];  // m/s, before the tick
  Scalar inverse_mass;
  Scalar angular[3];  // rad/s, world axes
  Scalar unused;
  Scalar factor[6];  // C: 00, 10, 11, 20, 21, 22
  Scalar unused_too[2];
};

// Patches in lanes, as rows are set up. A lane that is not used has neither points nor impulses, and its
// bodies are 0.
template <typename Scalar>
struct PatchLanes {
  using Lane = Scalar[kRowLanesMax];
  // Lever of a, lever of b, normal, gap and impulse of a point: 11 scalars, which are 0 beyond a patch's
  // last.
  const Scalar* point[kRowPointsMax][kRowLanesMax];
  const Scalar* impulse[kRowLanesMax];  // of friction and twist: 4 scalars
  const RowBodyTerms<Scalar>* a[kRowLanesMax];
  const RowBodyTerms<Scalar>* b[kRowLanesMax];
  std::int32_t place_a[kRowLanesMax];  // in ContactRows::bodies
  std::int32_t place_b[kRowLanesMax];
  alignas(32) Lane friction;
  alignas(32) Lane restitution;
  alignas(32) Lane bounce_from;  // m/s, the approach from which points bounce
  alignas(32) Lane has_course;   // 0 or 1
  alignas(32) Lane points;
};

// What surfaces of their own add to the patches of a group; lanes of usual ones have shares of 1, and 0
// elsewhere.
template <typename Scalar>
struct SurfaceLanes {
  using Lane = Scalar[kRowLanesMax];
  alignas(32) Lane direction[3];
  alignas(32) Lane along;
  alignas(32) Lane across;
  alignas(32) Lane drift[3];
  alignas(32) Lane torsion;
  alignas(32) Lane rolling;
  alignas(32) Lane rolling_impulse[3];
  alignas(32) Lane drifts;  // 0 or 1
};

// What the courses of patches add to their relative velocities; 0 in lanes of patches without.
template <typename Scalar>
struct CourseLanes {
  using Lane = Scalar[kRowLanesMax];
  alignas(32) Lane normal[kRowPointsMax];  // m/s, by point
  alignas(32) Lane linear[3];              // m/s, at the centre of the points
  alignas(32) Lane angular[3];             // rad/s
  alignas(32) Lane twist;                  // rad/s
};

// Their impulses after the tick.
template <typename Scalar>
struct ImpulseLanes {
  using Lane = Scalar[kRowLanesMax];
  alignas(32) Lane normal[kRowPointsMax];
  alignas(32) Lane friction[3];
  alignas(32) Lane twist;
  alignas(32) Lane rolling[3];  // where rows have grips
};

template <typename Scalar>
struct ContactRows {
  RowBody<Scalar>* bodies;
  const RowBody<Scalar>* forces;    // what they add in a step
  const RowBody<Scalar>* advanced;  // as bodies moved in this step
  std::int32_t still;               // the place of what cannot be pushed, which is never written
  std::size_t groups;               // of patches, a lane each, that share no body but `still`
  void* group;                      // arrays of what the kernel lays out, from the first of the groups on
  void* friction;
  void* grips;  // null where all surfaces are usual
  void* rows;
  Scalar time_step;  // s, of the tick
  Scalar step;       // s
  Scalar share;      // of a step in a tick
  // Of soft contacts.
  Scalar push_rate;       // 1/s: velocity by overlap
  Scalar push_speed_max;  // m/s
  Scalar mass_share;
  Scalar impulse_share;
};

template <typename Scalar>
struct ContactPasses {
  void (*warm_start)(const ContactRows<Scalar>& rows);
  void (*biased)(const ContactRows<Scalar>& rows);
  // Gaps move on by `advanced`, too, and impulses of the step are added to those of the tick.
  void (*relaxed)(const ContactRows<Scalar>& rows);
  // One of several passes, after all steps.
  void (*rebound)(const ContactRows<Scalar>& rows);
};

template <typename Scalar>
struct ContactKernel {
  int lanes;
  std::size_t group_size;  // bytes
  std::size_t friction_size;
  std::size_t grip_size;
  std::size_t row_size;

  // Group n, with its rows from row `first`, as many as its patch of most points has points. `surfaces` is
  // null where all are usual.
  void (*set_up)(const ContactRows<Scalar>& rows, std::size_t n, std::size_t first, std::size_t points,
                 const PatchLanes<Scalar>& patches, const SurfaceLanes<Scalar>* surfaces);
  // Adds to the relative velocities of group n, as they were before the tick.
  void (*add_course)(const ContactRows<Scalar>& rows, std::size_t n, const CourseLanes<Scalar>& course);
  ContactPasses<Scalar> usual;
  ContactPasses<Scalar> with_grips;
  // Whether a point of group n meets fast enough to bounce.
  bool (*may_bounce)(const ContactRows<Scalar>& rows, std::size_t n);
  // The impulses of group n.
  void (*end)(const ContactRows<Scalar>& rows, std::size_t n, ImpulseLanes<Scalar>& impulses);
};

// For every processor of the architecture, in lanes of 128 bits at most.
extern const ContactKernel<float> kContactKernelFloat1;
extern const ContactKernel<float> kContactKernelFloat4;
extern const ContactKernel<double> kContactKernelDouble1;
extern const ContactKernel<double> kContactKernelDouble2;
#if defined(__x86_64__)
// For processors with AVX2.
extern const ContactKernel<float> kContactKernelFloat8;
extern const ContactKernel<double> kContactKernelDouble4;
#endif

}  // namespace tessera
