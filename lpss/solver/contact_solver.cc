#include "lpss/solver/contact_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <numeric>
#include <type_traits>

namespace tessera {
namespace {

// A contact is a spring that its load compresses: at 30 Hz, as in Box2D, a tower of ten boxes is 27 mm lower,
// and one of twenty buckles; at 60 Hz 7 mm, and both stand. Stiffer ones need more passes than is practical.
constexpr double kFrequencyTick = 1;     // of the rate of ticks, at most
constexpr double kFrequencyStep = 0.25;  // of the rate of steps, at most
// The same where a load of some hundred weights or more asks for many steps, so many times the usual ones: on
// stiffer contacts, a body that rests on two of a hundredth of its weight rattles until it falls off, and one
// of 10,000 times the weight of what it rests on walks away.
constexpr double kFrequencyManySteps = 1.0 / 6;
constexpr double kManyStepsMin = 8;
constexpr double kContactDamping = 10;  // of critical damping
constexpr double kPushSpeedMax = 3;  // m/s, at which overlaps are corrected; more where contacts are stiffer

// Of loops over threads, which cost some microseconds each.
constexpr std::size_t kPatchesToSplit = 4096;
constexpr std::size_t kGroupsInPiece = 16;
constexpr std::size_t kBodiesAtOnce = 512;

const ParallelFor kOneThread;

// From the fewest lanes to the most.
#if defined(__x86_64__)
template <typename Scalar>
std::span<const ContactKernel<Scalar>* const> kernels() {
  static constexpr auto kAll = [] {
    if constexpr (std::is_same_v<Scalar, float>)
      return std::array{&kContactKernelFloat1, &kContactKernelFloat4, &kContactKernelFloat8};
    else
      return std::array{&kContactKernelDouble1, &kContactKernelDouble2, &kContactKernelDouble4};
  }();
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  return std::span(kAll).first(has_avx2 ? 3 : 2);
}
#else
template <typename Scalar>
std::span<const ContactKernel<Scalar>* const> kernels() {
  static constexpr auto kAll = [] {
    if constexpr (std::is_same_v<Scalar, float>)
      return std::array{&kContactKernelFloat1, &kContactKernelFloat4};
    else
      return std::array{&kContactKernelDouble1, &kContactKernelDouble2};
  }();
  return kAll;
}
#endif

template <typename Scalar>
Scalar inverse_or_zero(Scalar value) {
  return value > 0 ? 1 / value : 0;
}

template <typename Vector, typename Scalar>
void write(const Vector& v, Scalar* to) {
  to[0] = v.x();
  to[1] = v.y();
  to[2] = v.z();
}

// The lower triangular C with C C^T = m: 00, 10, 11, 20, 21, 22. Rounding cannot lock an axis: the square of
// a diagonal element is kept above what rounding leaves of m's.
template <typename Matrix, typename Scalar>
void factorise(const Matrix& m, Scalar* c) {
  const auto diagonal = [](Scalar square, Scalar of) {
    return std::sqrt(std::max(square, of * (4 * std::numeric_limits<Scalar>::epsilon())));
  };
  c[0] = diagonal(m(0, 0), m(0, 0));
  const Scalar inverse_0 = inverse_or_zero(c[0]);
  c[1] = m(1, 0) * inverse_0;
  c[2] = diagonal(m(1, 1) - c[1] * c[1], m(1, 1));
  c[3] = m(2, 0) * inverse_0;
  c[4] = (m(2, 1) - c[3] * c[1]) * inverse_or_zero(c[2]);
  c[5] = diagonal(m(2, 2) - c[3] * c[3] - c[4] * c[4], m(2, 2));
}

// C^-1 v, without the axes that are locked.
template <typename Vector, typename Scalar>
inline Vector scaled(const Scalar* c, const Vector& v) {
  const Scalar x = v.x() * inverse_or_zero(c[0]);
  const Scalar y = (v.y() - c[1] * x) * inverse_or_zero(c[2]);
  const Scalar z = (v.z() - c[3] * x - c[4] * y) * inverse_or_zero(c[5]);
  return {x, y, z};
}

// One lane, by a motion of the surface of a past that of b around the centre of the points.
template <typename Patch, typename Vector, typename Scalar>
void fill_lane(const Patch& patch, const Vector& linear, const Vector& angular, std::size_t lane,
               CourseLanes<Scalar>& lanes) {
  Vector centre = Vector::Zero();
  Vector normal = Vector::Zero();
  for (std::size_t k = 0; k < patch.points; ++k) {
    centre += patch.point[k].lever_a / static_cast<Scalar>(patch.points);
    normal += patch.point[k].normal;
  }
  for (std::size_t k = 0; k < patch.points; ++k) {
    const Vector arm = patch.point[k].lever_a - centre;
    lanes.normal[k][lane] = patch.point[k].normal.dot(linear + angular.cross(arm));
  }
  for (int axis = 0; axis < 3; ++axis) {
    lanes.linear[axis][lane] = linear[axis];
    lanes.angular[axis][lane] = angular[axis];
  }
  lanes.twist[lane] = normal.squaredNorm() > 0 ? normal.normalized().dot(angular) : Scalar(0);
}

}  // namespace

template <typename Scalar>
std::span<const int> ContactSolver<Scalar>::widths() {
  static const std::vector<int> widths = [] {
    std::vector<int> all;
    for (const ContactKernel<Scalar>* kernel : kernels<Scalar>()) all.push_back(kernel->lanes);
    return all;
  }();
  return widths;
}

template <typename Scalar>
void ContactSolver<Scalar>::begin(const Options& options, std::span<const Body> bodies,
                                  std::span<const Patch> patches, std::span<const std::size_t> stage_ends) {
  options_ = options;
  bodies_ = bodies;
  parallel_ = options.parallel && patches.size() >= kPatchesToSplit ? options.parallel : &kOneThread;
  rows_.time_step = options.time_step;
  rows_.share = 1 / static_cast<Scalar>(options.steps);
  rows_.step = options.time_step / static_cast<Scalar>(options.steps);
  const Scalar stiffer = std::max(Scalar(1), Scalar(options.steps) / Scalar(options.usual_steps));
  const double most = stiffer >= Scalar(kManyStepsMin) ? kFrequencyManySteps : kFrequencyStep;
  const Scalar frequency =
      std::min(stiffer * Scalar(kFrequencyTick) / options.time_step, Scalar(most) / rows_.step);
  const Scalar omega = 2 * std::numbers::pi_v<Scalar> * frequency;
  const Scalar a = 2 * Scalar(kContactDamping) + rows_.step * omega;
  const Scalar b = rows_.step * omega * a;
  rows_.push_rate = omega / a;
  rows_.push_speed_max = Scalar(kPushSpeedMax) * stiffer;
  rows_.impulse_share = 1 / (1 + b);
  rows_.mass_share = b * rows_.impulse_share;

  terms_.resize(bodies.size());
  moving_.resize(bodies.size() + 1);
  forces_.resize(bodies.size() + 1);
  advanced_.resize(bodies.size() + 1);
  correction_.resize(bodies.size());
  for_each_body([&](std::size_t n) { begin_body(n); });
  moving_[bodies.size()] = {};
  forces_[bodies.size()] = {};
  advanced_[bodies.size()] = {};
  rows_.bodies = moving_.data();
  rows_.forces = forces_.data();
  rows_.advanced = advanced_.data();
  rows_.still = static_cast<std::int32_t>(bodies.size());

  begin_patches(patches, stage_ends);
}

template <typename Scalar>
void ContactSolver<Scalar>::begin_patches(std::span<const Patch> patches,
                                          std::span<const std::size_t> stage_ends) {
  group_patches(patches, stage_ends);
  find_waves(patches);
  group_storage_.resize(groups_.size() * kernel_->group_size);
  friction_storage_.resize(groups_.size() * kernel_->friction_size);
  if (has_surfaces_) grip_storage_.resize(groups_.size() * kernel_->grip_size);
  first_row_.resize(groups_.size());
  std::exclusive_scan(points_.begin(), points_.end(), first_row_.begin(), std::size_t{0});
  const std::size_t rows = groups_.size() > 0 ? first_row_.back() + points_.back() : 0;
  row_storage_.resize(rows * kernel_->row_size);
  rows_.groups = groups_.size();
  rows_.group = group_storage_.data();
  rows_.friction = friction_storage_.data();
  rows_.grips = has_surfaces_ ? grip_storage_.data() : nullptr;
  rows_.rows = row_storage_.data();
  run_in_pieces(*parallel_, groups_.size(), kGroupsInPiece, [&](std::size_t n) { begin_group(n, patches); });
  may_bounce_ = false;
  for (std::size_t n = 0; n < groups_.size() && !may_bounce_; ++n)
    may_bounce_ = kernel_->may_bounce(rows_, n);
  courses_.clear();
  if (has_courses_) begin_courses(patches);
}

// Without threads, a stage is one wave: its groups are solved in their order anyway.
template <typename Scalar>
void ContactSolver<Scalar>::find_waves(std::span<const Patch> patches) {
  // Calls act(body) for the pushed bodies of a group.
  const auto for_each_pushed = [&](std::size_t group, const auto& act) {
    for (const std::uint32_t n : groups_[group]) {
      if (n == PatchGroups::kNone) break;
      for (const std::size_t body : {patches[n].a, patches[n].b}) {
        if (bodies_[body].inverse_mass > 0) act(body);
      }
    }
  };
  waves_.clear();
  first_wave_.clear();
  if (*parallel_) wave_of_.assign(bodies_.size(), 0);
  for (std::size_t stage = 0; stage + 1 < stages_.size(); ++stage) {
    first_wave_.push_back(waves_.size());
    waves_.push_back(stages_[stage]);
    if (!*parallel_) continue;
    for (std::size_t group = stages_[stage]; group < stages_[stage + 1]; ++group) {
      bool is_met = false;
      for_each_pushed(group, [&](std::size_t body) { is_met |= wave_of_[body] == waves_.size(); });
      if (is_met) waves_.push_back(group);
      for_each_pushed(group, [&](std::size_t body) { wave_of_[body] = waves_.size(); });
    }
  }
  first_wave_.push_back(waves_.size());
  waves_.push_back(groups_.size());
}

template <typename Scalar>
template <typename Act>
void ContactSolver<Scalar>::for_each_body(const Act& act) const {
  run_in_pieces(*parallel_, bodies_.size(), kBodiesAtOnce, act);
}

template <typename Scalar>
void ContactSolver<Scalar>::run(void (*act)(const ContactRows<Scalar>&), std::size_t stage) const {
  for (std::size_t wave = first_wave_[stage]; wave < first_wave_[stage + 1]; ++wave) {
    const Pieces pieces(waves_[wave + 1] - waves_[wave], kGroupsInPiece);
    run_parallel(*parallel_, pieces.count(), [&](std::size_t piece) {
      const std::size_t first = waves_[wave] + pieces.begin(piece);
      ContactRows<Scalar> rows = rows_;
      rows.groups = pieces.end(piece) - pieces.begin(piece);
      rows.group = static_cast<std::byte*>(rows_.group) + first * kernel_->group_size;
      rows.friction = static_cast<std::byte*>(rows_.friction) + first * kernel_->friction_size;
      if (has_surfaces_) rows.grips = static_cast<std::byte*>(rows_.grips) + first * kernel_->grip_size;
      act(rows);
    });
  }
}

template <typename Scalar>
void ContactSolver<Scalar>::begin_body(std::size_t n) {
  const Body& body = bodies_[n];
  RowBodyTerms<Scalar>& terms = terms_[n];
  terms = {};
  write(body.linear, terms.linear);
  write(body.angular, terms.angular);
  terms.inverse_mass = body.inverse_mass;
  factorise(body.inverse_inertia, terms.factor);
  moving_[n] = {};
  moving_[n].inverse_mass = body.inverse_mass;
  forces_[n] = {};
  write(body.linear_force * rows_.share, forces_[n].linear);
  write(scaled(terms.factor, Vector(body.angular_force * rows_.share)), forces_[n].angular);
  correction_[n] = {};
}

// In the widest lanes of which the patches fill at least two on average.
template <typename Scalar>
void ContactSolver<Scalar>::group_patches(std::span<const Patch> patches,
                                          std::span<const std::size_t> stage_ends) {
  const auto all = kernels<Scalar>();
  const auto pushed = [&](std::size_t body) {
    return bodies_[body].inverse_mass > 0 ? static_cast<std::uint32_t>(body) : PatchGroups::kNone;
  };
  for (std::size_t n = all.size(); n-- > 0;) {
    kernel_ = all[n];
    const auto lanes = static_cast<std::size_t>(kernel_->lanes);
    if (options_.lanes != 0 && options_.lanes != kernel_->lanes) continue;
    groups_.clear(bodies_.size(), lanes);
    points_.clear();
    has_surfaces_ = false;
    has_courses_ = false;
    stages_.assign(1, 0);
    std::size_t next = 0;
    std::size_t solved = 0;
    for (const std::size_t end : stage_ends) {
      for (; next < end; ++next) {
        const Patch& patch = patches[next];
        if (patch.is_jointed) {
          groups_.skip();
          continue;
        }
        ++solved;
        const std::size_t group = groups_.add(pushed(patch.a), pushed(patch.b));
        if (group == points_.size()) points_.push_back(0);
        points_[group] = std::max(points_[group], static_cast<std::uint8_t>(patch.points));
        has_surfaces_ = has_surfaces_ || patch.surface;
        has_courses_ = has_courses_ || patch.course;
      }
      groups_.fence();
      stages_.push_back(groups_.size());
    }
    if (options_.lanes != 0 || groups_.size() * 2 <= solved) return;
  }
}

template <typename Scalar>
const SurfaceLanes<Scalar>* ContactSolver<Scalar>::surfaces_of(std::size_t group,
                                                               std::span<const Patch> patches,
                                                               SurfaceLanes<Scalar>& lanes) const {
  static const typename SolverTypes<Scalar>::Surface kUsual;
  bool is_any = false;
  std::size_t lane = 0;
  for (const std::uint32_t n : groups_[group]) {
    const auto* const own = n != PatchGroups::kNone ? patches[n].surface : nullptr;
    const auto& surface = own ? *own : kUsual;
    is_any = is_any || own;
    for (int axis = 0; axis < 3; ++axis) {
      lanes.direction[axis][lane] = surface.direction[axis];
      lanes.drift[axis][lane] = surface.drift[axis];
      lanes.rolling_impulse[axis][lane] = surface.rolling_impulse[axis];
    }
    lanes.along[lane] = surface.along;
    lanes.across[lane] = surface.across;
    lanes.torsion[lane] = surface.torsion;
    lanes.rolling[lane] = surface.rolling;
    lanes.drifts[lane] = surface.drift.isZero(0) ? 0 : 1;
    ++lane;
  }
  return is_any ? &lanes : nullptr;
}

// So gravity and the length of ticks decide what rattles and what bounces.
template <typename Scalar>
Scalar ContactSolver<Scalar>::bounce_from(const Patch& patch) const {
  const Scalar most =
      std::max(bodies_[patch.a].linear_force.squaredNorm(), bodies_[patch.b].linear_force.squaredNorm());
  return std::max(options_.bounce_from * std::sqrt(most), options_.bounce_from_min);
}

template <typename Scalar>
void ContactSolver<Scalar>::begin_group(std::size_t group, std::span<const Patch> patches) {
  static_assert(offsetof(Point, gap) == 9 * sizeof(Scalar) && sizeof(Point) == 11 * sizeof(Scalar));
  static_assert(offsetof(Patch, twist_impulse) == offsetof(Patch, friction_impulse) + 3 * sizeof(Scalar));
  static const Patch kNoPatch;
  static constexpr RowBodyTerms<Scalar> kNoBody{};
  static constexpr Scalar kZeros[11]{};
  const auto place = [&](std::size_t body) {
    return bodies_[body].inverse_mass > 0 ? static_cast<std::int32_t>(body) : rows_.still;
  };
  PatchLanes<Scalar> lanes;
  SurfaceLanes<Scalar> surface_lanes;
  const SurfaceLanes<Scalar>* const surfaces =
      has_surfaces_ ? surfaces_of(group, patches, surface_lanes) : nullptr;
  std::size_t lane = 0;
  for (const std::uint32_t n : groups_[group]) {
    const bool is_used = n != PatchGroups::kNone;
    const Patch& patch = is_used ? patches[n] : kNoPatch;
    lanes.a[lane] = is_used ? &terms_[patch.a] : &kNoBody;
    lanes.b[lane] = is_used ? &terms_[patch.b] : &kNoBody;
    lanes.place_a[lane] = is_used ? place(patch.a) : rows_.still;
    lanes.place_b[lane] = is_used ? place(patch.b) : rows_.still;
    for (std::size_t k = 0; k < points_[group]; ++k)
      lanes.point[k][lane] = k < patch.points ? patch.point[k].lever_a.data() : kZeros;
    lanes.impulse[lane] = patch.friction_impulse.data();
    lanes.friction[lane] = patch.friction;
    lanes.restitution[lane] = patch.restitution;
    lanes.has_course[lane] = patch.course ? 1 : 0;
    lanes.bounce_from[lane] = is_used && patch.restitution > 0 ? bounce_from(patch) : 0;
    lanes.points[lane] = static_cast<Scalar>(patch.points);
    ++lane;
  }
  kernel_->set_up(rows_, group, first_row_[group], points_[group], lanes, surfaces);
}

template <typename Scalar>
void ContactSolver<Scalar>::begin_courses(std::span<const Patch> patches) {
  for (std::size_t group = 0; group < groups_.size(); ++group) {
    CourseLanes<Scalar> start{};
    CourseLanes<Scalar> step{};
    bool is_any = false;
    std::size_t lane = 0;
    for (const std::uint32_t n : groups_[group]) {
      if (n != PatchGroups::kNone && patches[n].course) {
        const Course& course = *patches[n].course;
        fill_lane(patches[n], course.linear, course.angular, lane, start);
        fill_lane(patches[n], Vector(course.linear_change * rows_.share),
                  Vector(course.angular_change * rows_.share), lane, step);
        is_any = true;
      }
      ++lane;
    }
    if (!is_any) continue;
    kernel_->add_course(rows_, group, start);
    courses_.emplace_back(group, step);
  }
}

// Forces of one step, and the impulses of the step before.
template <typename Scalar>
void ContactSolver<Scalar>::start_step() {
  for_each_body([&](std::size_t n) {
    for (int axis = 0; axis < 3; ++axis) {
      moving_[n].linear[axis] += forces_[n].linear[axis];
      moving_[n].angular[axis] += forces_[n].angular[axis];
    }
  });
  for (const auto& [group, step] : courses_) kernel_->add_course(rows_, group, step);
  for (std::size_t stage = 0; stage + 1 < stages_.size(); ++stage) run(passes().warm_start, stage);
}

template <typename Scalar>
void ContactSolver<Scalar>::pass(bool biased, std::size_t stage) {
  run(biased ? passes().biased : passes().relaxed, stage);
}

// Bodies move by the velocities of the biased passes; what the relaxed pass takes back, end_step() does.
template <typename Scalar>
void ContactSolver<Scalar>::advance() {
  std::copy_n(moving_.data(), bodies_.size(), advanced_.data());
}

// The way of the biased passes without that of the velocities that stay is what opened overlaps. These are
// then how bodies move until they rebound.
template <typename Scalar>
void ContactSolver<Scalar>::end_step() {
  for_each_body([&](std::size_t n) {
    for (int axis = 0; axis < 3; ++axis) {
      correction_[n].linear[axis] += (advanced_[n].linear[axis] - moving_[n].linear[axis]) * rows_.step;
      correction_[n].angular[axis] += (advanced_[n].angular[axis] - moving_[n].angular[axis]) * rows_.step;
    }
    advanced_[n] = moving_[n];
  });
}

template <typename Scalar>
void ContactSolver<Scalar>::rebound(std::size_t stage) {
  run(passes().rebound, stage);
}

template <typename Scalar>
void ContactSolver<Scalar>::end(std::span<Patch> patches) const {
  run_in_pieces(*parallel_, groups_.size(), kGroupsInPiece, [&](std::size_t n) { end_group(n, patches); });
}

template <typename Scalar>
void ContactSolver<Scalar>::end_group(std::size_t group, std::span<Patch> patches) const {
  ImpulseLanes<Scalar> lanes;
  kernel_->end(rows_, group, lanes);
  std::size_t lane = 0;
  for (const std::uint32_t n : groups_[group]) {
    if (n == PatchGroups::kNone) break;
    Patch& patch = patches[n];
    for (std::size_t k = 0; k < patch.points; ++k) patch.point[k].impulse = lanes.normal[k][lane];
    for (int axis = 0; axis < 3; ++axis) patch.friction_impulse[axis] = lanes.friction[axis][lane];
    patch.twist_impulse = lanes.twist[lane];
    if (patch.surface) {
      for (int axis = 0; axis < 3; ++axis) patch.surface->rolling_impulse[axis] = lanes.rolling[axis][lane];
    }
    ++lane;
  }
}

template <typename Scalar>
inline auto ContactSolver<Scalar>::unscaled(std::size_t body, const Scalar* angular) const -> Vector {
  const Scalar* const c = terms_[body].factor;
  return {c[0] * angular[0], c[1] * angular[0] + c[2] * angular[1],
          c[3] * angular[0] + c[4] * angular[1] + c[5] * angular[2]};
}

template <typename Scalar>
inline auto ContactSolver<Scalar>::change(std::size_t body) const -> Motion {
  const RowBody<Scalar>& moving = moving_[body];
  return {Vector(moving.linear), unscaled(body, moving.angular)};
}

template <typename Scalar>
void ContactSolver<Scalar>::set_change(std::size_t body, const Motion& change) {
  RowBody<Scalar>& moving = moving_[body];
  const Vector more = scaled(terms_[body].factor, Vector(change.angular - unscaled(body, moving.angular)));
  for (int axis = 0; axis < 3; ++axis) {
    moving.linear[axis] = change.linear[axis] + 0;  // never -0, which unused points of a group would change
    moving.angular[axis] += more[axis];
  }
}

template <typename Scalar>
auto ContactSolver<Scalar>::correction(std::size_t body) const -> Motion {
  RowBody<Scalar> way = correction_[body];
  for (int axis = 0; axis < 3; ++axis) {
    way.linear[axis] += (advanced_[body].linear[axis] - moving_[body].linear[axis]) * rows_.time_step;
    way.angular[axis] += (advanced_[body].angular[axis] - moving_[body].angular[axis]) * rows_.time_step;
  }
  return {Vector(way.linear), unscaled(body, way.angular)};
}

template class ContactSolver<float>;
template class ContactSolver<double>;

}  // namespace tessera
