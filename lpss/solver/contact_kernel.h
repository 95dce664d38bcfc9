// The kernel of contact_rows.h, for any Lanes. Included by one file for each processor it is compiled for.
#pragma once

#include "lpss/solver/contact_rows.h"
#include "lpss/solver/lanes.h"

namespace tessera {
namespace {

template <typename L>
class Kernel {
  using Scalar = typename L::Scalar;
  using V = typename L::Vector;
  using Rows = ContactRows<Scalar>;
  using Patches = PatchLanes<Scalar>;

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
    std::uint16_t has_jointed;
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

  struct Friction {
    V3 tangent[2];
    V3 a[2];  // scaled
    V3 b[2];
    V3 twist_a;
    V3 twist_b;
    V start[2];     // m/s, along the tangents, before the tick
    V twist_start;  // rad/s
    V mass[3];      // of the tangents: the inverse of a symmetric matrix (00, 01, 11)
    V twist_mass;
    V friction;
    V restitution;
    V is_jointed;  // 0 or 1
    V radius;      // m, the mean distance of the points from their centre: the arm of the twist
    // Of a step, and of all steps.
    V impulse[2];
    V twist_impulse;
    V total[2];
    V twist_total;
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
    p.angular = p.angular + f.twist_a * impulse;
    q.angular = q.angular - f.twist_b * impulse;
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

  static TESSERA_INLINE void solve_normal(const Rows& rows, Row& row, bool is_biased, Motion& p, Motion& q) {
    const V zero = V{};
    V wanted = row.approach_max;
    V impulse = row.impulse;
    V mass = row.mass;
    if (is_biased) {
      // A gap may close by the end of the tick; an overlap is opened like an overdamped spring.
      const auto is_open = row.gap >= zero;
      wanted = is_open ? wanted : min(-row.gap * rows.push_rate, splat(rows.push_speed_max));
      mass = is_open ? mass : mass * rows.mass_share;
      impulse = is_open ? impulse : impulse * (1 - rows.impulse_share);
    }
    // In this order little has to wait for the velocities.
    const V at_rest = impulse + (wanted - row.start) * mass;
    impulse = max(at_rest - relative(row.normal, row.a, row.b, p, q) * mass, zero);
    push(row.normal, row.a, row.b, impulse - row.impulse, p, q);
    row.impulse = impulse;
  }

  // Where `is_masked`, only patches of jointed bodies.
  static TESSERA_INLINE void solve_friction(Friction& f, const Row* row, int points, bool is_masked,
                                            Motion& p, Motion& q) {
    V most = row[0].impulse;
    for (int n = 1; n < points; ++n) most = most + row[n].impulse;
    most = most * f.friction;

    const auto is_off = f.is_jointed == V{};
    const V slide[2] = {f.start[0] + relative(f.tangent[0], f.a[0], f.b[0], p, q),
                        f.start[1] + relative(f.tangent[1], f.a[1], f.b[1], p, q)};
    V wanted[2] = {f.impulse[0] - (f.mass[0] * slide[0] + f.mass[1] * slide[1]),
                   f.impulse[1] - (f.mass[1] * slide[0] + f.mass[2] * slide[1])};
    const V length = root(wanted[0] * wanted[0] + wanted[1] * wanted[1]);
    const V scale = length > most ? most / length : splat(1);
    for (int k = 0; k < 2; ++k) {
      wanted[k] = wanted[k] * scale;
      if (is_masked) wanted[k] = is_off ? f.impulse[k] : wanted[k];
      push(f.tangent[k], f.a[k], f.b[k], wanted[k] - f.impulse[k], p, q);
      f.impulse[k] = wanted[k];
    }

    const V spin = f.twist_start + (dot(f.twist_a, p.angular) - dot(f.twist_b, q.angular));
    const V twist_max = most * f.radius;
    V turned = min(max(f.twist_impulse - f.twist_mass * spin, -twist_max), twist_max);
    if (is_masked) turned = is_off ? f.twist_impulse : turned;
    twist(f, turned - f.twist_impulse, p, q);
    f.twist_impulse = turned;
  }

  static void set_up(const Rows& rows, std::size_t n, std::size_t first, std::size_t points,
                     const Patches& patches) {
    Group& group = static_cast<Group*>(rows.group)[n];
    group.first = static_cast<std::uint32_t>(first);
    group.points = static_cast<std::uint16_t>(points);
    group.has_jointed = 0;
    for (int lane = 0; lane < L::kWidth; ++lane) {
      group.a[lane] = patches.place_a[lane];
      group.b[lane] = patches.place_b[lane];
      if (patches.is_jointed[lane] != 0) group.has_jointed = 1;
    }
    const Terms a = gather_terms(patches.a);
    const Terms b = gather_terms(patches.b);
    Row* const row = static_cast<Row*>(rows.rows) + first;
    Points levers;
    for (std::size_t k = 0; k < points; ++k) {
      V v[12];
      gather<L, 8>(patches.point[k], v);
      const Scalar* rest[L::kWidth];
      for (int lane = 0; lane < L::kWidth; ++lane) rest[lane] = patches.point[k][lane] + 7;
      gather<L, 4>(rest, v + 7);
      levers.lever_a[k] = {v[0], v[1], v[2]};
      levers.lever_b[k] = {v[3], v[4], v[5]};
      row[k].normal = {v[6], v[7], v[8]};
      row[k].gap = v[9];
      row[k].impulse = v[10] * rows.share;
      set_up_normal(rows, levers.lever_a[k], levers.lever_b[k], a, b, row[k]);
    }
    set_up_friction(rows, patches, points, levers, a, b, row, static_cast<Friction*>(rows.friction)[n]);
  }

  static TESSERA_INLINE void set_up_normal(const Rows& rows, const V3& lever_a, const V3& lever_b,
                                           const Terms& a, const Terms& b, Row& row) {
    const V3 turn_a = cross(lever_a, row.normal);
    const V3 turn_b = cross(lever_b, row.normal);
    row.a = scaled(a, turn_a);
    row.b = scaled(b, turn_b);
    row.mass = inverse_or_zero(a.inverse_mass + b.inverse_mass + dot(row.a, row.a) + dot(row.b, row.b));
    row.start = dot(row.normal, a.linear - b.linear) + (dot(turn_a, a.angular) - dot(turn_b, b.angular));
    row.approach_max = min(-row.gap / rows.time_step, V{});
    row.total = V{};
  }

  // Friction acts at the centre of the points. Its impulse of the last tick is projected on the new plane,
  // and limited by the new normal impulses.
  static TESSERA_INLINE void set_up_friction(const Rows& rows, const Patches& patches, std::size_t points,
                                             const Points& levers, const Terms& a, const Terms& b,
                                             const Row* row, Friction& f) {
    const V zero = V{};
    V3 lever_a{zero, zero, zero};
    V3 lever_b = lever_a;
    V3 normal = lever_a;
    for (std::size_t k = 0; k < points; ++k) {
      lever_a = lever_a + levers.lever_a[k];
      lever_b = lever_b + levers.lever_b[k];
      normal = normal + row[k].normal;
    }
    const V count = max(load(patches.points), splat(1));
    lever_a = lever_a / count;
    lever_b = lever_b / count;
    normal = normal * inverse_or_zero(root(dot(normal, normal)));
    // By the levers of a side that can be pushed: those of the other one say nothing.
    const auto is_by_a = a.inverse_mass > zero;
    f.radius = zero;
    for (std::size_t k = 0; k < points; ++k) {
      const V3 arm = select(is_by_a, levers.lever_a[k] - lever_a, levers.lever_b[k] - lever_b);
      const V distance = root(dot(arm, arm));
      f.radius = f.radius + (splat(static_cast<Scalar>(k)) < count ? distance : zero);
    }
    f.radius = f.radius / count;

    span_plane(normal, f.tangent[0], f.tangent[1]);
    for (int k = 0; k < 2; ++k) {
      const V3 turn_a = cross(lever_a, f.tangent[k]);
      const V3 turn_b = cross(lever_b, f.tangent[k]);
      f.a[k] = scaled(a, turn_a);
      f.b[k] = scaled(b, turn_b);
      f.start[k] = dot(f.tangent[k], a.linear - b.linear) + (dot(turn_a, a.angular) - dot(turn_b, b.angular));
    }
    const V masses = a.inverse_mass + b.inverse_mass;
    const V k00 = masses + (dot(f.a[0], f.a[0]) + dot(f.b[0], f.b[0]));
    const V k01 = dot(f.a[0], f.a[1]) + dot(f.b[0], f.b[1]);
    const V k11 = masses + (dot(f.a[1], f.a[1]) + dot(f.b[1], f.b[1]));
    const V inverse = inverse_or_zero(k00 * k11 - k01 * k01);
    f.mass[0] = k11 * inverse;
    f.mass[1] = -k01 * inverse;
    f.mass[2] = k00 * inverse;

    f.twist_start = dot(normal, a.angular - b.angular);
    f.twist_a = scaled(a, normal);
    f.twist_b = scaled(b, normal);
    f.twist_mass = inverse_or_zero(dot(f.twist_a, f.twist_a) + dot(f.twist_b, f.twist_b));

    f.friction = load(patches.friction);
    f.restitution = load(patches.restitution);
    f.is_jointed = load(patches.is_jointed);
    V most = zero;
    for (std::size_t k = 0; k < points; ++k) most = most + f.friction * row[k].impulse;
    V v[4];
    gather<L, 4>(patches.impulse, v);
    const V3 last = V3{v[0], v[1], v[2]} * splat(rows.share);
    const V impulse[2] = {dot(last, f.tangent[0]), dot(last, f.tangent[1])};
    const V length = root(impulse[0] * impulse[0] + impulse[1] * impulse[1]);
    const V scale = length > most ? most / length : splat(1);
    const V twist_max = most * f.radius;
    f.twist_impulse = min(max(v[3] * rows.share, -twist_max), twist_max);
    f.twist_total = zero;
    for (int k = 0; k < 2; ++k) {
      f.impulse[k] = impulse[k] * scale;
      f.total[k] = zero;
    }
  }

  // Calls act(group, its friction, its rows, the motions of both sides) for each group in order.
  template <typename Act>
  static TESSERA_INLINE void for_each(const Rows& rows, const Act& act) {
    const Group* const groups = static_cast<const Group*>(rows.group);
    for (std::size_t n = 0; n < rows.groups; ++n) {
      const Group& group = groups[n];
      Motion p = gather_motion(rows.bodies, group.a);
      Motion q = gather_motion(rows.bodies, group.b);
      act(group, static_cast<Friction*>(rows.friction)[n], static_cast<Row*>(rows.rows) + group.first, p, q);
      scatter_motion(p, rows, group.a);
      scatter_motion(q, rows, group.b);
    }
  }

  static void warm_start(const Rows& rows) {
    for_each(rows, [](const Group& group, const Friction& f, const Row* row, Motion& p, Motion& q) {
      for (int k = 0; k < group.points; ++k) push(row[k].normal, row[k].a, row[k].b, row[k].impulse, p, q);
      for (int k = 0; k < 2; ++k) push(f.tangent[k], f.a[k], f.b[k], f.impulse[k], p, q);
      twist(f, f.twist_impulse, p, q);
    });
  }

  static void biased_pass(const Rows& rows) {
    for_each(rows, [&](const Group& group, Friction& f, Row* row, Motion& p, Motion& q) {
      if (group.has_jointed) solve_friction(f, row, group.points, true, p, q);
      for (int k = 0; k < group.points; ++k) solve_normal(rows, row[k], true, p, q);
    });
  }

  static void relaxed_pass(const Rows& rows) {
    for_each(rows, [&](const Group& group, Friction& f, Row* row, Motion& p, Motion& q) {
      const Motion advanced_a = gather_motion(rows.advanced, group.a);
      const Motion advanced_b = gather_motion(rows.advanced, group.b);
      solve_friction(f, row, group.points, false, p, q);
      for (int k = 0; k < 2; ++k) f.total[k] = f.total[k] + f.impulse[k];
      f.twist_total = f.twist_total + f.twist_impulse;
      for (int k = 0; k < group.points; ++k) {
        Row& r = row[k];
        r.gap = r.gap + (r.start + relative(r.normal, r.a, r.b, advanced_a, advanced_b)) * rows.step;
        solve_normal(rows, r, false, p, q);
        r.total = r.total + r.impulse;
      }
    });
  }

  // Two that have touched part with the share of the speed at which they met: that before the tick, and what
  // forces did on the way since, v^2 = v0^2 + 2 a s.
  static void rebound(const Rows& rows) {
    for_each(rows, [&](const Group& group, const Friction& f, Row* row, Motion& p, Motion& q) {
      const V zero = V{};
      const Motion force_a = gather_motion(rows.forces, group.a);
      const Motion force_b = gather_motion(rows.forces, group.b);
      const Motion before_a = gather_motion(rows.advanced, group.a);
      const Motion before_b = gather_motion(rows.advanced, group.b);
      for (int k = 0; k < group.points; ++k) {
        Row& r = row[k];
        const V approach = max(-r.start - relative(r.normal, r.a, r.b, before_a, before_b), zero);
        const V way = min(approach, -r.approach_max) * rows.time_step;
        const V pull = relative(r.normal, r.a, r.b, force_a, force_b) / splat(rows.step);
        const V met = root(max(r.start * r.start - 2 * pull * way, zero));
        const V wanted = -r.start > splat(rows.bounce_from) ? f.restitution * met : zero;
        const V missing = wanted - (r.start + relative(r.normal, r.a, r.b, p, q));
        V impulse = max(r.impulse + missing * r.mass, zero);
        impulse = wanted > zero ? impulse : r.impulse;
        impulse = r.total > zero ? impulse : r.impulse;
        const V more = impulse - r.impulse;
        push(r.normal, r.a, r.b, more, p, q);
        r.total = r.total + more;
        r.impulse = impulse;
      }
    });
  }

  static void end(const Rows& rows, std::size_t n, ImpulseLanes<Scalar>& impulses) {
    const Group& group = static_cast<const Group*>(rows.group)[n];
    const Friction& f = static_cast<const Friction*>(rows.friction)[n];
    const Row* const row = static_cast<const Row*>(rows.rows) + group.first;
    for (int k = 0; k < group.points; ++k) store(row[k].total, impulses.normal[k]);
    const V3 friction = f.tangent[0] * f.total[0] + f.tangent[1] * f.total[1];
    store(friction.x, impulses.friction[0]);
    store(friction.y, impulses.friction[1]);
    store(friction.z, impulses.friction[2]);
    store(f.twist_total, impulses.twist);
  }

 public:
  static constexpr ContactKernel<Scalar> kTable = {
      L::kWidth,  sizeof(Group), sizeof(Friction), sizeof(Row), set_up,
      warm_start, biased_pass,   relaxed_pass,     rebound,     end};
};

}  // namespace
}  // namespace tessera
