// What the kernel of contact_kernel.h keeps of patches, several side by side, and sums over them. Included by
// one file for each processor it is compiled for.
#pragma once

#include "lpss/solver/contact_rows.h"
#include "lpss/solver/lanes.h"

namespace tessera {
namespace {

template <typename L>
struct ContactLanes {
  using Scalar = typename L::Scalar;
  using V = typename L::Vector;
  using Rows = ContactRows<Scalar>;
  using Patches = PatchLanes<Scalar>;
  using Surfaces = SurfaceLanes<Scalar>;

  struct V3 {
    V x, y, z;

    friend TESSERA_INLINE V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend TESSERA_INLINE V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend TESSERA_INLINE V3 operator*(const V3& a, V s) { return {a.x * s, a.y * s, a.z * s}; }
    friend TESSERA_INLINE V3 operator/(const V3& a, V s) { return {a.x / s, a.y / s, a.z / s}; }
  };

  struct Group {
    std::int32_t a[L::kWidth];
    std::int32_t b[L::kWidth];
    std::uint32_t first;
    std::uint16_t points;
    std::uint8_t may_bounce;  // a point of a patch meets fast enough
    std::uint8_t has_course;
  };

  struct Points {
    V3 lever_a[kRowPointsMax];
    V3 lever_b[kRowPointsMax];
  };

  struct Row {
    V3 normal;
    V3 a;  // scaled
    V3 b;
    V mass;
    V start;         // m/s, before the tick
    V gap;           // m, in this step
    V approach_max;  // m/s, at most 0: what closes the gap by the end of the tick
    V impulse;       // N s, of a step
    V total;         // of all steps
  };

  // Three rows of one block: along both tangents, and the twist about the normal as the speed at `radius`.
  struct Friction {
    V3 tangent[2];
    V3 a[3];  // scaled
    V3 b[3];
    V start[3];          // m/s, before the tick
    V mass[6];           // the inverse of a symmetric matrix (00, 01, 11, 02, 12, 22)
    V slip_mobility[2];  // of all tangents and of the twist: together at least what a unit of impulse changes
    V friction;
    V restitution;
    V has_course;   // 0 or 1: friction acts in all passes
    V bounce_from;  // m/s, the approach from which points bounce
    V radius;       // m, the mean distance of the points from their centre: the arm of the twist
    V impulse[3];   // N s, of a step
    V total[3];     // of all steps
  };

  // Of patches with surfaces of their own: what resists rolling, as the angular velocity about two directions
  // along the contact.
  struct Grip {
    V3 tangent[2];
    V3 a[2];  // scaled
    V3 b[2];
    V start[2];  // rad/s, before the tick
    V mass[3];   // as that of friction
    V arm;       // m
    V impulse[2];
    V total[2];
  };

  // The two sides of a group's patches.
  struct Motion {
    V3 linear;
    V inverse_mass;
    V3 angular;
  };
  struct Terms {
    V3 linear;
    V inverse_mass;
    V3 angular;
    V factor[6];
  };

  static TESSERA_INLINE V splat(Scalar s) { return V{} + s; }
  static TESSERA_INLINE V load(const Scalar* s) { return *reinterpret_cast<const V*>(s); }
  static TESSERA_INLINE V3 load(const Scalar (*s)[kRowLanesMax]) {
    return {load(s[0]), load(s[1]), load(s[2])};
  }
  static TESSERA_INLINE void store(V v, Scalar* s) { *reinterpret_cast<V*>(s) = v; }

  // The second operand where one is not a number.
  static TESSERA_INLINE V min(V a, V b) { return a < b ? a : b; }
  static TESSERA_INLINE V max(V a, V b) { return a > b ? a : b; }
  static TESSERA_INLINE V inverse_or_zero(V v) {
    const V zero = V{};
    return v > zero ? splat(1) / v : zero;
  }
  static TESSERA_INLINE V dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
  static TESSERA_INLINE V3 cross(const V3& a, const V3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
  static TESSERA_INLINE V3 select(auto mask, const V3& a, const V3& b) {
    return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z};
  }

  static TESSERA_INLINE Motion gather_motion(const RowBody<Scalar>* bodies, const std::int32_t* places) {
    const Scalar* from[L::kWidth];
#pragma GCC unroll 8
    for (int lane = 0; lane < L::kWidth; ++lane) from[lane] = bodies[places[lane]].linear;
    V v[8];
    gather<L, 8>(from, v);
    return {{v[0], v[1], v[2]}, v[3], {v[4], v[5], v[6]}};
  }

  static TESSERA_INLINE void scatter_motion(const Motion& motion, const Rows& rows,
                                            const std::int32_t* places) {
    Scalar* to[L::kWidth];
#pragma GCC unroll 8
    for (int lane = 0; lane < L::kWidth; ++lane) to[lane] = rows.bodies[places[lane]].linear;
    V v[8] = {motion.linear.x,  motion.linear.y,  motion.linear.z,  motion.inverse_mass,
              motion.angular.x, motion.angular.y, motion.angular.z, V{}};
    scatter<L, 8>(v, to, places, rows.still);
  }

  static TESSERA_INLINE Terms gather_terms(const RowBodyTerms<Scalar>* const* bodies) {
    const Scalar* from[L::kWidth];
#pragma GCC unroll 8
    for (int lane = 0; lane < L::kWidth; ++lane) from[lane] = bodies[lane]->linear;
    V v[16];
    gather<L, 16>(from, v);
    return {{v[0], v[1], v[2]}, v[3], {v[4], v[5], v[6]}, {v[8], v[9], v[10], v[11], v[12], v[13]}};
  }

  // C^T v.
  static TESSERA_INLINE V3 scaled(const Terms& body, const V3& v) {
    const V* const c = body.factor;
    return {c[0] * v.x + c[1] * v.y + c[3] * v.z, c[2] * v.y + c[4] * v.z, c[5] * v.z};
  }

  // The change of the velocity of two sides along a direction.
  static TESSERA_INLINE V relative(const V3& direction, const V3& a, const V3& b, const Motion& p,
                                   const Motion& q) {
    return dot(direction, p.linear - q.linear) + (dot(a, p.angular) - dot(b, q.angular));
  }

  static TESSERA_INLINE void push(const V3& direction, const V3& a, const V3& b, V impulse, Motion& p,
                                  Motion& q) {
    p.linear = p.linear + direction * (p.inverse_mass * impulse);
    p.angular = p.angular + a * impulse;
    q.linear = q.linear - direction * (q.inverse_mass * impulse);
    q.angular = q.angular - b * impulse;
  }

  static TESSERA_INLINE void twist(const Friction& f, V impulse, Motion& p, Motion& q) {
    p.angular = p.angular + f.a[2] * impulse;
    q.angular = q.angular - f.b[2] * impulse;
  }

  // Two directions perpendicular to a unit vector and to each other, by its components alone.
  static TESSERA_INLINE void span_plane(const V3& normal, V3& p, V3& q) {
    const V zero = V{};
    const auto is_steep = max(normal.z, -normal.z) > splat(Scalar(0.70710678118654752440));
    const V square =
        (is_steep ? normal.z : normal.x) * (is_steep ? normal.z : normal.x) + normal.y * normal.y;
    const V scale = inverse_or_zero(root(square));
    p = select(is_steep, V3{zero, -normal.z * scale, normal.y * scale},
               V3{-normal.y * scale, normal.x * scale, zero});
    q = cross(normal, p);
  }

  static TESSERA_INLINE void roll(const Grip& r, int k, V impulse, Motion& p, Motion& q) {
    p.angular = p.angular + r.a[k] * impulse;
    q.angular = q.angular - r.b[k] * impulse;
  }

  // What brings a vector within a length.
  template <int kSize>
  static TESSERA_INLINE V scale_within(const V (&v)[kSize], V most) {
    const V length = root(square(v));
    return length > most ? most / length : splat(1);
  }
  template <int kSize>
  static TESSERA_INLINE V square(const V (&v)[kSize]) {
    V sum = v[0] * v[0];
    for (int k = 1; k < kSize; ++k) sum = sum + v[k] * v[k];
    return sum;
  }

  // The inverse of a symmetric matrix (00, 01, 11); 0 if there is none.
  static TESSERA_INLINE void invert(V k00, V k01, V k11, V* inverse) {
    const V factor = inverse_or_zero(k00 * k11 - k01 * k01);
    inverse[0] = k11 * factor;
    inverse[1] = -k01 * factor;
    inverse[2] = k00 * factor;
  }
};

}  // namespace
}  // namespace tessera
