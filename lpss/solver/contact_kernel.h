// The kernel of contact_rows.h, for any Lanes. Included by one file for each processor it is compiled for.
#pragma once

#include "lpss/solver/contact_lanes.h"
#include "lpss/solver/contact_rows.h"

namespace tessera {
namespace {

// m: what is no farther apart is as soft as what overlaps. A corner over a gap of a rounding would stay hard
// while its neighbours sink under their load: it turned a box on level ground, and a tower leaned by 14 mm.
constexpr double kClosed = 1e-6;

// Of the mobility of a twist: where the tangents leave less of it, that is rounding.
constexpr double kTwistLeft = 1e-5;

template <typename L>
class Kernel : ContactLanes<L> {
  using Base = ContactLanes<L>;
  using Base::cross;
  using Base::dot;
  using Base::gather_motion;
  using Base::gather_terms;
  using Base::inverse_or_zero;
  using Base::invert;
  using Base::load;
  using Base::max;
  using Base::min;
  using Base::push;
  using Base::relative;
  using Base::roll;
  using Base::scale_within;
  using Base::scaled;
  using Base::scatter_motion;
  using Base::select;
  using Base::span_plane;
  using Base::splat;
  using Base::square;
  using Base::store;
  using Base::twist;
  using typename Base::Friction;
  using typename Base::Grip;
  using typename Base::Group;
  using typename Base::Motion;
  using typename Base::Patches;
  using typename Base::Points;
  using typename Base::Row;
  using typename Base::Rows;
  using typename Base::Scalar;
  using typename Base::Surfaces;
  using typename Base::Terms;
  using typename Base::V;
  using typename Base::V3;

  static TESSERA_INLINE void solve_normal(const Rows& rows, Row& row, bool is_biased, Motion& p, Motion& q) {
    const V impulse = wanted_impulse(rows, row, is_biased, p, q);
    push(row.normal, row.a, row.b, impulse - row.impulse, p, q);
    row.impulse = impulse;
  }

  static TESSERA_INLINE V wanted_impulse(const Rows& rows, const Row& row, bool is_biased, const Motion& p,
                                         const Motion& q) {
    const V zero = V{};
    V wanted = row.approach_max;
    V impulse = row.impulse;
    V mass = row.mass;
    if (is_biased) {
      // A gap may close by the end of the tick; what touches is held, and an overlap opened, like by an
      // overdamped spring.
      const auto is_open = row.gap >= splat(Scalar(kClosed));
      wanted = is_open ? wanted : min(-row.gap * rows.push_rate, splat(rows.push_speed_max));
      mass = is_open ? mass : mass * rows.mass_share;
      impulse = is_open ? impulse : impulse * (1 - rows.impulse_share);
    }
    // In this order little has to wait for the velocities.
    const V at_rest = impulse + (wanted - row.start) * mass;
    return max(at_rest - relative(row.normal, row.a, row.b, p, q) * mass, zero);
  }

  // The points of a patch that is going to rebound settle before the next one has its turn: what falls flat
  // rebounds flat, in whatever order they have theirs. Softness is for what rests.
  static TESSERA_INLINE void solve_impact(const Rows& rows, const Friction& f, Row* row, int points,
                                          Motion& p, Motion& q) {
    constexpr int kRounds = 6;
    V fast{};
    for (int k = 0; k < points; ++k) fast = fast + max(-row[k].start - f.bounce_from, V{});
    const auto is_off = fast * f.restitution == V{};
    for (int round = 0; round < kRounds; ++round) {
      for (int k = 0; k < points; ++k) {
        Row& r = row[k];
        const V impulse = wanted_impulse(rows, r, false, p, q);
        const V more = is_off ? V{} : impulse - r.impulse;
        push(r.normal, r.a, r.b, more, p, q);
        r.impulse = is_off ? r.impulse : impulse;
      }
    }
  }

  // The impulses of all points of a patch.
  static TESSERA_INLINE V load_of(const Row* row, int points) {
    V load = row[0].impulse;
    for (int n = 1; n < points; ++n) load = load + row[n].impulse;
    return load;
  }

  // Of the patches in `mask`, all that are not 0. Sliding and twisting share one bound, the ellipsoid of Howe
  // and Cutkosky ("Practical Force-Motion Models for Sliding Manipulation", 1996), which is a ball here,
  // since the twist is a speed at the mean distance of the points.
  static TESSERA_INLINE void solve_friction(Friction& f, const Row* row, int points, V mask, Motion& p,
                                            Motion& q) {
    const V most = load_of(row, points) * f.friction;
    const auto is_off = mask == V{};
    const V slide[3] = {f.start[0] + relative(f.tangent[0], f.a[0], f.b[0], p, q),
                        f.start[1] + relative(f.tangent[1], f.a[1], f.b[1], p, q),
                        f.start[2] + (dot(f.a[2], p.angular) - dot(f.b[2], q.angular))};
    const V* const m = f.mass;
    V wanted[3] = {f.impulse[0] - (m[0] * slide[0] + m[1] * slide[1] + m[3] * slide[2]),
                   f.impulse[1] - (m[1] * slide[0] + m[2] * slide[1] + m[4] * slide[2]),
                   f.impulse[2] - (m[3] * slide[0] + m[4] * slide[1] + m[5] * slide[2])};
    const V excess = square(wanted) - most * most;
    if (any(max(excess, V{}))) {
      V slipping[3];
      slip(f, slide, most, slipping);
      for (int k = 0; k < 3; ++k) wanted[k] = excess > V{} ? slipping[k] : wanted[k];
    }
    for (int k = 0; k < 3; ++k) wanted[k] = is_off ? f.impulse[k] : wanted[k];
    for (int k = 0; k < 2; ++k) push(f.tangent[k], f.a[k], f.b[k], wanted[k] - f.impulse[k], p, q);
    twist(f, wanted[2] - f.impulse[2], p, q);
    for (int k = 0; k < 3; ++k) f.impulse[k] = wanted[k];
  }

  // Where it takes more than there is to hold, the patch slips, and friction opposes the slip: with
  // mobilities D of no coupling that are at least those of the rows, (D + k) impulse = D impulse of now -
  // slide, for the k > 0 that gives it its largest size. Where nothing changes any more, k impulse = -slide.
  static TESSERA_INLINE void slip(const Friction& f, const V (&slide)[3], V most, V (&impulse)[3]) {
    constexpr int kSteps = 2;
    const V zero = V{};
    const V d[3] = {f.slip_mobility[0], f.slip_mobility[0], f.slip_mobility[1]};
    V pull[3];
    for (int k = 0; k < 3; ++k) pull[k] = d[k] * f.impulse[k] - slide[k];
    const V per_most = inverse_or_zero(most);
    // Newton's method for 1 / size, which comes from below, and does not go beyond.
    V damping = max(root(square(pull)) * per_most - max(d[0], d[2]), zero);
    for (int step = 0;; ++step) {
      const V along = inverse_or_zero(d[0] + damping);
      const V about = inverse_or_zero(d[2] + damping);
      impulse[0] = pull[0] * along;
      impulse[1] = pull[1] * along;
      impulse[2] = pull[2] * about;
      if (step == kSteps) break;
      const V planar = impulse[0] * impulse[0] + impulse[1] * impulse[1];
      const V turned = impulse[2] * impulse[2];
      const V size = root(planar + turned);
      const V slope = planar * along + turned * about;
      damping = damping + max((planar + turned) * inverse_or_zero(slope) * ((size - most) * per_most), zero);
    }
    const V scale = scale_within(impulse, most);
    for (int k = 0; k < 3; ++k) impulse[k] = impulse[k] * scale;
  }

  // Likewise.
  static TESSERA_INLINE void solve_rolling(Grip& r, const Row* row, int points, V mask, Motion& p,
                                           Motion& q) {
    const V most = load_of(row, points) * r.arm;
    const auto is_off = mask == V{};
    V turn[2];
    for (int k = 0; k < 2; ++k) turn[k] = r.start[k] + (dot(r.a[k], p.angular) - dot(r.b[k], q.angular));
    V wanted[2] = {r.impulse[0] - (r.mass[0] * turn[0] + r.mass[1] * turn[1]),
                   r.impulse[1] - (r.mass[1] * turn[0] + r.mass[2] * turn[1])};
    // Lanes that do not roll are here, too, if others do: however small or large their spins are, nothing is
    // added to them.
    const auto rolls = most > V{};
    const V scale = scale_within(wanted, most);
    for (int k = 0; k < 2; ++k) {
      wanted[k] = is_off ? r.impulse[k] : rolls ? wanted[k] * scale : V{};
      roll(r, k, wanted[k] - r.impulse[k], p, q);
      r.impulse[k] = wanted[k];
    }
  }

  static void set_up(const Rows& rows, std::size_t n, std::size_t first, std::size_t points,
                     const Patches& patches, const Surfaces* surfaces) {
    Group& group = static_cast<Group*>(rows.group)[n];
    group.first = static_cast<std::uint32_t>(first);
    group.points = static_cast<std::uint16_t>(points);
    for (int lane = 0; lane < L::kWidth; ++lane) {
      group.a[lane] = patches.place_a[lane];
      group.b[lane] = patches.place_b[lane];
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
    const V bounce_from = load(patches.bounce_from);
    V fast{};
    for (std::size_t k = 0; k < points; ++k) fast = fast + max(-row[k].start - bounce_from, V{});
    group.may_bounce = any(fast * load(patches.restitution));
    group.has_course = any(load(patches.has_course));
    Friction& friction = static_cast<Friction*>(rows.friction)[n];
    Grip* const grip = rows.grips ? static_cast<Grip*>(rows.grips) + n : nullptr;
    if (surfaces)
      return set_up_friction<true>(rows, patches, surfaces, points, levers, a, b, row, friction, grip);
    set_up_friction<false>(rows, patches, nullptr, points, levers, a, b, row, friction, grip);
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

  // The tangents of friction that differs by direction: its ellipse is a circle in tangents that are scaled
  // by the shares of its axes, where impulses and velocities are those of the unscaled ones times and by the
  // shares. So the impulse that the circle bounds dissipates most, as that of the ellipse should.
  static TESSERA_INLINE void scale_tangents(const Surfaces& surfaces, const V3& normal, V3* tangent,
                                            V* share) {
    const V3 given = load(surfaces.direction);
    const V3 flat = given - normal * dot(given, normal);
    const V square = dot(flat, flat);
    // Along the normal it says nothing: the smaller share then holds everywhere.
    const auto is_flat = square > splat(Scalar(1e-6));
    const V3 unit = flat * inverse_or_zero(root(is_flat ? square : V{}));
    const V along = load(surfaces.along);
    const V across = load(surfaces.across);
    share[0] = is_flat ? along : min(along, across);
    share[1] = is_flat ? across : share[0];
    tangent[0] = select(is_flat, unit, tangent[0]) * share[0];
    tangent[1] = select(is_flat, cross(normal, unit), tangent[1]) * share[1];
  }

  // With the inverse masses of both sides together.
  template <bool kHasSurfaces>
  static TESSERA_INLINE void set_up_masses(V masses, const V* share, Friction& f) {
    const V zero = V{};
    V along[2] = {masses, masses};
    if constexpr (kHasSurfaces) {
      for (int k = 0; k < 2; ++k) along[k] = masses * (share[k] * share[k]);
    }
    const auto mobility = [&f](int n, int k) { return dot(f.a[n], f.a[k]) + dot(f.b[n], f.b[k]); };
    const V k00 = along[0] + mobility(0, 0);
    const V k01 = mobility(0, 1);
    const V k11 = along[1] + mobility(1, 1);
    const V k02 = mobility(0, 2);
    const V k12 = mobility(1, 2);
    const V k22 = mobility(2, 2);
    invert(k00, k01, k11, f.mass);
    const V half = (k00 - k11) * splat(Scalar(0.5));
    const V coupling = root(k02 * k02 + k12 * k12);
    f.slip_mobility[0] = (k00 + k11) * splat(Scalar(0.5)) + root(half * half + k01 * k01) + coupling;
    f.slip_mobility[1] = k22 + coupling;
    if constexpr (kHasSurfaces) {
      // Where one direction has no friction at all, the other one is on its own.
      f.mass[0] = k11 > zero ? f.mass[0] : inverse_or_zero(k00);
      f.mass[2] = k00 > zero ? f.mass[2] : inverse_or_zero(k11);
    }
    // The twist, were the tangents held.
    const V held[2] = {f.mass[0] * k02 + f.mass[1] * k12, f.mass[1] * k02 + f.mass[2] * k12};
    const V rest = k22 - (held[0] * k02 + held[1] * k12);
    const V twist_mass = rest > k22 * splat(Scalar(kTwistLeft)) ? splat(1) / rest : zero;
    f.mass[0] = f.mass[0] + held[0] * held[0] * twist_mass;
    f.mass[1] = f.mass[1] + held[0] * held[1] * twist_mass;
    f.mass[2] = f.mass[2] + held[1] * held[1] * twist_mass;
    f.mass[3] = -held[0] * twist_mass;
    f.mass[4] = -held[1] * twist_mass;
    f.mass[5] = twist_mass;
  }

  // Of the last tick, limited by the new normal impulses: the twist by what sliding leaves of them.
  template <bool kHasSurfaces>
  static TESSERA_INLINE void set_up_impulses(const Rows& rows, const Patches& patches, const V* share,
                                             std::size_t points, const Row* row, Friction& f) {
    V most{};
    for (std::size_t k = 0; k < points; ++k) most = most + f.friction * row[k].impulse;
    V v[4];
    gather<L, 4>(patches.impulse, v);
    const V3 last = V3{v[0], v[1], v[2]} * splat(rows.share);
    V impulse[2] = {dot(last, f.tangent[0]), dot(last, f.tangent[1])};
    if constexpr (kHasSurfaces) {
      for (int k = 0; k < 2; ++k) impulse[k] = impulse[k] * inverse_or_zero(share[k] * share[k]);
    }
    const V scale = scale_within(impulse, most);
    for (int k = 0; k < 2; ++k) f.impulse[k] = impulse[k] * scale;
    const V left = max(most * most - (f.impulse[0] * f.impulse[0] + f.impulse[1] * f.impulse[1]), V{});
    const V turned = v[3] * rows.share * inverse_or_zero(f.radius);
    f.impulse[2] = min(max(turned, -root(left)), root(left));
    for (V& total : f.total) total = V{};
  }

  static TESSERA_INLINE void set_up_rolling(const Rows& rows, const Surfaces* surfaces, const V3* tangent,
                                            const Terms& a, const Terms& b, V load_of_points, Grip& r) {
    r.arm = surfaces ? load(surfaces->rolling) : V{};
    const V3 last = surfaces ? load(surfaces->rolling_impulse) : V3{};
    for (int k = 0; k < 2; ++k) {
      r.tangent[k] = tangent[k];
      r.a[k] = scaled(a, tangent[k]);
      r.b[k] = scaled(b, tangent[k]);
      r.start[k] = dot(tangent[k], a.angular - b.angular);
      r.impulse[k] = dot(last, tangent[k]) * rows.share;
      r.total[k] = V{};
    }
    const V k00 = dot(r.a[0], r.a[0]) + dot(r.b[0], r.b[0]);
    const V k01 = dot(r.a[0], r.a[1]) + dot(r.b[0], r.b[1]);
    const V k11 = dot(r.a[1], r.a[1]) + dot(r.b[1], r.b[1]);
    invert(k00, k01, k11, r.mass);
    const V scale = scale_within(r.impulse, load_of_points * r.arm);
    for (V& impulse : r.impulse) impulse = impulse * scale;
  }

  // Friction acts at the centre of the points. Its impulse of the last tick is projected on the new plane,
  // and limited by the new normal impulses.
  template <bool kHasSurfaces>
  static TESSERA_INLINE void set_up_friction(const Rows& rows, const Patches& patches,
                                             const Surfaces* surfaces, std::size_t points,
                                             const Points& levers, const Terms& a, const Terms& b,
                                             const Row* row, Friction& f, Grip* grip) {
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
    if (grip) {
      V load_of_points = zero;
      for (std::size_t k = 0; k < points; ++k) load_of_points = load_of_points + row[k].impulse;
      set_up_rolling(rows, surfaces, f.tangent, a, b, load_of_points, *grip);
    }
    V share[2];
    if constexpr (kHasSurfaces) {
      scale_tangents(*surfaces, normal, f.tangent, share);
      // Lanes without torsion are here, too, if others have some.
      const V torsion = load(surfaces->torsion);
      const V arm = min(torsion * inverse_or_zero(load(patches.friction)), splat(Scalar(kTwistArmMax)));
      f.radius = f.radius + (torsion > zero ? arm : zero);
    }
    for (int k = 0; k < 2; ++k) {
      const V3 turn_a = cross(lever_a, f.tangent[k]);
      const V3 turn_b = cross(lever_b, f.tangent[k]);
      f.a[k] = scaled(a, turn_a);
      f.b[k] = scaled(b, turn_b);
      f.start[k] = dot(f.tangent[k], a.linear - b.linear) + (dot(turn_a, a.angular) - dot(turn_b, b.angular));
    }
    const V3 turn = normal * f.radius;
    f.a[2] = scaled(a, turn);
    f.b[2] = scaled(b, turn);
    f.start[2] = dot(turn, a.angular - b.angular);
    set_up_masses<kHasSurfaces>(a.inverse_mass + b.inverse_mass, share, f);
    if constexpr (kHasSurfaces) {
      const auto drifts = load(surfaces->drifts) > zero;
      const V3 drift = load(surfaces->drift);
      for (int k = 0; k < 2; ++k) f.start[k] = drifts ? f.start[k] + dot(f.tangent[k], drift) : f.start[k];
    }

    f.friction = load(patches.friction);
    f.restitution = load(patches.restitution);
    f.bounce_from = load(patches.bounce_from);
    f.has_course = load(patches.has_course);
    set_up_impulses<kHasSurfaces>(rows, patches, share, points, row, f);
  }

  static void add_course(const Rows& rows, std::size_t n, const CourseLanes<Scalar>& course) {
    const Group& group = static_cast<const Group*>(rows.group)[n];
    Row* const row = static_cast<Row*>(rows.rows) + group.first;
    for (int k = 0; k < group.points; ++k) row[k].start = row[k].start + load(course.normal[k]);
    Friction& f = static_cast<Friction*>(rows.friction)[n];
    const V3 linear = load(course.linear);
    for (int k = 0; k < 2; ++k) f.start[k] = f.start[k] + dot(f.tangent[k], linear);
    f.start[2] = f.start[2] + f.radius * load(course.twist);
    if (!rows.grips) return;
    Grip& r = static_cast<Grip*>(rows.grips)[n];
    const V3 angular = load(course.angular);
    for (int k = 0; k < 2; ++k) r.start[k] = r.start[k] + dot(r.tangent[k], angular);
  }

  // Calls act(group, its place, its friction, its rows, the motions of both sides) for each group in order.
  template <typename Act>
  static TESSERA_INLINE void for_each(const Rows& rows, const Act& act) {
    const Group* const groups = static_cast<const Group*>(rows.group);
    for (std::size_t n = 0; n < rows.groups; ++n) {
      const Group& group = groups[n];
      Motion p = gather_motion(rows.bodies, group.a);
      Motion q = gather_motion(rows.bodies, group.b);
      act(group, n, static_cast<Friction*>(rows.friction)[n], static_cast<Row*>(rows.rows) + group.first, p,
          q);
      scatter_motion(p, rows, group.a);
      scatter_motion(q, rows, group.b);
    }
  }

  template <bool kHasGrips>
  static void warm_start(const Rows& rows) {
    for_each(rows,
             [&](const Group& group, std::size_t n, const Friction& f, const Row* row, Motion& p, Motion& q) {
               for (int k = 0; k < group.points; ++k)
                 push(row[k].normal, row[k].a, row[k].b, row[k].impulse, p, q);
               for (int k = 0; k < 2; ++k) push(f.tangent[k], f.a[k], f.b[k], f.impulse[k], p, q);
               twist(f, f.impulse[2], p, q);
               if constexpr (kHasGrips) {
                 const Grip& r = static_cast<const Grip*>(rows.grips)[n];
                 for (int k = 0; k < 2; ++k) roll(r, k, r.impulse[k], p, q);
               }
             });
  }

  template <bool kHasGrips>
  static void biased_pass(const Rows& rows) {
    for_each(rows, [&](const Group& group, std::size_t n, Friction& f, Row* row, Motion& p, Motion& q) {
      if (group.has_course) {
        solve_friction(f, row, group.points, f.has_course, p, q);
        if constexpr (kHasGrips)
          solve_rolling(static_cast<Grip*>(rows.grips)[n], row, group.points, f.has_course, p, q);
      }
      for (int k = 0; k < group.points; ++k) solve_normal(rows, row[k], true, p, q);
      if (group.may_bounce) solve_impact(rows, f, row, group.points, p, q);
    });
  }

  template <bool kHasGrips>
  static void relaxed_pass(const Rows& rows) {
    for_each(rows, [&](const Group& group, std::size_t n, Friction& f, Row* row, Motion& p, Motion& q) {
      const Motion advanced_a = gather_motion(rows.advanced, group.a);
      const Motion advanced_b = gather_motion(rows.advanced, group.b);
      solve_friction(f, row, group.points, splat(1), p, q);
      if constexpr (kHasGrips) {
        Grip& grip = static_cast<Grip*>(rows.grips)[n];
        solve_rolling(grip, row, group.points, splat(1), p, q);
        for (int k = 0; k < 2; ++k) grip.total[k] = grip.total[k] + grip.impulse[k];
      }
      for (int k = 0; k < 3; ++k) f.total[k] = f.total[k] + f.impulse[k];
      for (int k = 0; k < group.points; ++k) {
        Row& r = row[k];
        r.gap = r.gap + (r.start + relative(r.normal, r.a, r.b, advanced_a, advanced_b)) * rows.step;
        solve_normal(rows, r, false, p, q);
      }
      if (group.may_bounce) solve_impact(rows, f, row, group.points, p, q);
      for (int k = 0; k < group.points; ++k) row[k].total = row[k].total + row[k].impulse;
    });
  }

  // Whether velocities differ, in any of their numbers: not 0 if so.
  static TESSERA_INLINE V differ(const Motion& p, const Motion& q) {
    const V3 linear = p.linear - q.linear;
    const V3 angular = p.angular - q.angular;
    return dot(linear, linear) + dot(angular, angular);
  }

  // What a point of a patch that rebounds is to move at, along its normal. Two that have touched part with
  // the share of the speed at which they met: that before the tick, and what forces did on the way since, v^2
  // = v0^2 + 2 a s. Others hold, as they did, what rebounds push against them: `bounces` is 0 there.
  static TESSERA_INLINE V rebound_speed(const Rows& rows, const Friction& f, const Row& r,
                                        const Motion (&forces)[2], const Motion (&before)[2], V& bounces) {
    const V zero = V{};
    const V approach = max(-r.start - relative(r.normal, r.a, r.b, before[0], before[1]), zero);
    const V way = min(approach, -r.approach_max) * rows.time_step;
    const V pull = relative(r.normal, r.a, r.b, forces[0], forces[1]) / splat(rows.step);
    const V met = root(max(r.start * r.start - 2 * pull * way, zero));
    V speed = -r.start > f.bounce_from ? f.restitution * met : zero;
    speed = r.total > zero ? speed : zero;
    bounces = speed > zero ? splat(1) : zero;
    return speed > zero ? speed : r.approach_max;
  }

  // All points of all patches that rebound do so together, as far as the passes of it converge: each pass
  // goes over those whose points bounce, and those that another one has pushed. Friction has what all
  // impulses allow, those of the rebound, too.
  template <bool kHasGrips>
  static void rebound(const Rows& rows) {
    constexpr int kRounds = 4;  // over the points of a patch
    for_each(rows, [&](const Group& group, std::size_t n, Friction& f, Row* row, Motion& p, Motion& q) {
      const V zero = V{};
      const Motion before[2] = {gather_motion(rows.advanced, group.a), gather_motion(rows.advanced, group.b)};
      const V struck = differ(p, before[0]) + differ(q, before[1]);
      if (!group.may_bounce && !any(struck)) return;
      const Motion forces[2] = {gather_motion(rows.forces, group.a), gather_motion(rows.forces, group.b)};
      V speed[kRowPointsMax];
      V acts[kRowPointsMax];
      V is_active = struck;
      for (int k = 0; k < group.points; ++k) {
        speed[k] = rebound_speed(rows, f, row[k], forces, before, acts[k]);
        is_active = is_active + acts[k];
      }
      if (!any(is_active)) return;
      for (int k = 0; k < group.points; ++k) acts[k] = acts[k] + struck;
      for (int round = 0; round < kRounds; ++round) {
        for (int k = 0; k < group.points; ++k) {
          Row& r = row[k];
          const V missing = speed[k] - (r.start + relative(r.normal, r.a, r.b, p, q));
          const V impulse = acts[k] > zero ? max(r.impulse + missing * r.mass, zero) : r.impulse;
          const V more = impulse - r.impulse;
          push(r.normal, r.a, r.b, more, p, q);
          r.total = r.total + more;
          r.impulse = impulse;
        }
        rub<kHasGrips>(rows, n, f, row, group.points, is_active, p, q);
      }
    });
  }

  // Friction of a rebound, which is added to that of the tick.
  template <bool kHasGrips>
  static TESSERA_INLINE void rub(const Rows& rows, std::size_t n, Friction& f, const Row* row, int points,
                                 V is_active, Motion& p, Motion& q) {
    const V before[3] = {f.impulse[0], f.impulse[1], f.impulse[2]};
    solve_friction(f, row, points, is_active, p, q);
    for (int k = 0; k < 3; ++k) f.total[k] = f.total[k] + (f.impulse[k] - before[k]);
    if constexpr (kHasGrips) {
      Grip& grip = static_cast<Grip*>(rows.grips)[n];
      const V rolled[2] = {grip.impulse[0], grip.impulse[1]};
      solve_rolling(grip, row, points, is_active, p, q);
      for (int k = 0; k < 2; ++k) grip.total[k] = grip.total[k] + (grip.impulse[k] - rolled[k]);
    }
  }

  static bool may_bounce(const Rows& rows, std::size_t n) {
    return static_cast<const Group*>(rows.group)[n].may_bounce;
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
    store(f.total[2] * f.radius, impulses.twist);
    if (!rows.grips) return;
    const Grip& r = static_cast<const Grip*>(rows.grips)[n];
    const V3 rolling = r.tangent[0] * r.total[0] + r.tangent[1] * r.total[1];
    store(rolling.x, impulses.rolling[0]);
    store(rolling.y, impulses.rolling[1]);
    store(rolling.z, impulses.rolling[2]);
  }

 public:
  template <bool kHasGrips>
  static constexpr ContactPasses<Scalar> kPasses{warm_start<kHasGrips>, biased_pass<kHasGrips>,
                                                 relaxed_pass<kHasGrips>, rebound<kHasGrips>};
  static constexpr ContactKernel<Scalar> kTable = {
      L::kWidth,  sizeof(Group),  sizeof(Friction), sizeof(Grip), sizeof(Row), set_up,
      add_course, kPasses<false>, kPasses<true>,    may_bounce,   end};
};

}  // namespace
}  // namespace tessera
