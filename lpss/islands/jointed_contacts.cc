#include "lpss/islands/jointed_contacts.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

using Eigen::Vector3d;

// Rounds over the patches of a cluster in a pass, at most, and what they settle to: m/s or rad/s.
constexpr int kRoundsMax = 30;
constexpr double kSettledPush = 1e-7;

// Tries of a pass, of which each finds what of drives, limits and friction does not hold.
constexpr int kTries = 4;

// As in the kernel of the contact solver.
constexpr double kClosedGap = 1e-6;  // m

// Of the largest mobility of a patch: what gives way less is held by joints.
constexpr double kMobileShare = 1e-9;

std::array<double, 2> times(const std::array<double, 3>& m, const std::array<double, 2>& v) {
  return {m[0] * v[0] + m[1] * v[1], m[1] * v[0] + m[2] * v[1]};
}

}  // namespace

JointedContacts::Wrench JointedContacts::velocities_of(const Member& member) const {
  if (member.jointed.assembly) return member.jointed.assembly->velocities(member.jointed.body);
  Wrench velocities = free_->change(member.place);
  velocities.head<3>() += bodies_[member.place].linear;
  velocities.tail<3>() += bodies_[member.place].angular;
  return velocities;
}

void JointedContacts::load() {
  for (const Member& member : members_)
    Wrench::Map(velocities_.data() + groups_[member.group].first + 6 * member.number) = velocities_of(member);
  std::ranges::fill(wrenches_, 0);
}

// Pushes bodies as if they were free: joints answer in their pass.
void JointedContacts::store() {
  for (const Member& member : members_) {
    const Eigen::Map<const Wrench> wrench(wrenches_.data() + groups_[member.group].first + 6 * member.number);
    if (wrench.isZero(0)) continue;
    const Contacts::Body& body = bodies_[member.place];
    Wrench change;
    change << wrench.head<3>() * body.inverse_mass, body.inverse_inertia * wrench.tail<3>();
    if (member.jointed.assembly) {
      member.jointed.assembly->push(member.jointed.body, change);
    } else {
      free_->push(member.place, change);
    }
  }
}

double JointedContacts::velocity_of(const Row& row, const std::vector<double>& velocities) const {
  double sum = row.drive;
  for (std::size_t side = 0; side < 2; ++side) {
    if (row.at[side] != kNone)
      sum += row.on[side].dot(Eigen::Map<const Wrench>(velocities.data() + row.at[side]));
  }
  return sum;
}

void JointedContacts::push(Row& row, double impulse) {
  if (impulse == 0) return;
  row.impulse += impulse;
  moved_ = std::max(moved_, std::abs(impulse * row.mobility));
  if (matrix_ == nullptr) return push_bodies(row, impulse);
  using Four = Eigen::Vector4d;
  const double* const answer = matrix_ + row.number * matrix_row_;
  for (std::size_t n = 0; n < matrix_row_; n += 4)
    Four::Map(row_velocities_.data() + n) += Four::Map(answer + n) * impulse;
}

void JointedContacts::push_bodies(const Row& row, double impulse) {
  for (const Answer& answer : row.answer) {
    const double* from = answers_.data() + answer.first;
    double* to = velocities_.data() + answer.velocity;
    for (std::size_t n = 0; n < answer.bodies; ++n, from += 6, to += 6)
      Eigen::Map<Wrench>(to) += Eigen::Map<const Wrench>(from) * impulse;
  }
  add_wrench(row, impulse);
}

void JointedContacts::add_wrench(const Row& row, double impulse) {
  for (std::size_t side = 0; side < 2; ++side) {
    if (row.at[side] != kNone) Eigen::Map<Wrench>(wrenches_.data() + row.at[side]) += row.on[side] * impulse;
  }
}

void JointedContacts::start_step() {
  if (is_empty()) return;
  for (Patch& patch : patches_) {
    if (!patch.course) continue;
    add_course(patch, patch.course->linear_change * softness_.share,
               patch.course->angular_change * softness_.share);
  }
  load();
  for_each_row(patches_, [this](const Row& row) { add_wrench(row, row.impulse); });
  store();
}

void JointedContacts::note_velocities() {
  if (is_empty()) return;
  load();
  noted_ = velocities_;
}

// Calls act(patch) for all patches, cluster by cluster, until these settle.
template <typename Act>
void JointedContacts::solve(Act act) {
  load();
  for (Cluster& cluster : clusters_) solve(cluster, act);
  store();
}

// Again where a drive, limit or friction does not bear what it was taken to.
template <typename Act>
void JointedContacts::solve(Cluster& cluster, Act act) {
  update_answers(cluster);
  const std::span<Patch> patches = patches_of(cluster);
  impulses_.clear();
  for_each_row(patches, [this](const Row& row) { impulses_.push_back(row.impulse); });
  start(cluster);
  for (int n = 1;; ++n) {
    go_over(patches, act);
    if (matrix_ != nullptr) {
      auto before = impulses_.begin();
      for_each_row(patches, [&](const Row& row) { add_wrench(row, row.impulse - *before++); });
    }
    if (n == kTries || bears(cluster)) break;
    update_answers(cluster);
    restart(cluster);
  }
  matrix_ = nullptr;
}

void JointedContacts::start(const Cluster& cluster) {
  if (cluster.matrix == kNone) {
    loaded_ = velocities_;
    return;
  }
  matrix_row_ = padded(cluster.rows);
  for_each_row(patches_of(cluster),
               [this](const Row& row) { row_velocities_[row.number] = velocity_of(row, velocities_); });
  matrix_ = matrices_.data() + cluster.matrix;
}

void JointedContacts::restart(const Cluster& cluster) {
  for (const std::size_t n : groups_of(cluster)) {
    const auto first = static_cast<std::ptrdiff_t>(groups_[n].first);
    const auto size = static_cast<std::ptrdiff_t>(groups_[n].size);
    if (matrix_ == nullptr) std::copy_n(loaded_.begin() + first, size, velocities_.begin() + first);
    std::fill_n(wrenches_.begin() + first, size, 0);
  }
  auto impulse = impulses_.begin();
  for_each_row(patches_of(cluster), [&](Row& row) { row.impulse = *impulse++; });
  start(cluster);
}

template <typename Act>
void JointedContacts::go_over(std::span<Patch> patches, Act act) {
  for (int round = 0; round < kRoundsMax; ++round) {
    moved_ = 0;
    for (Patch& patch : patches) act(patch);
    if (moved_ <= kSettledPush) return;
  }
}

bool JointedContacts::bears(const Cluster& cluster) const {
  bool all = true;
  for (const std::size_t n : groups_of(cluster)) {
    const Group& group = groups_[n];
    if (group.assembly && !group.assembly->bears({wrenches_.data() + group.first, group.size})) all = false;
  }
  return all;
}

void JointedContacts::settle() {
  if (is_empty()) return;
  solve([this](Patch& patch) {
    solve_friction(patch);
    if (patch.arm > 0) solve_rolling(patch);
    for (int n = 0; n < patch.points; ++n) solve_point(patch.point[static_cast<std::size_t>(n)], false);
  });
}

// Normal impulses alone: what opens overlaps drags nothing along.
void JointedContacts::open() {
  if (is_empty()) return;
  solve([this](Patch& patch) {
    for (int n = 0; n < patch.points; ++n) solve_point(patch.point[static_cast<std::size_t>(n)], true);
  });
}

void JointedContacts::relax() {
  if (is_empty()) return;
  const double step = softness_.step;
  for (Patch& patch : patches_) {
    for (int n = 0; n < patch.points; ++n) {
      Point& point = patch.point[static_cast<std::size_t>(n)];
      point.gap += velocity_of(point.row, noted_) * step;
    }
  }
  settle();
  for_each_row(patches_, [](Row& row) { row.total += row.impulse; });
}

void JointedContacts::solve_point(Point& point, bool biased) {
  const Softness& soft = softness_;
  Row& row = point.row;
  double wanted = point.approach_max;
  double impulse = row.impulse;
  double mass = row.mass;
  if (biased && point.gap < kClosedGap) {
    mass *= soft.mass_share;
    // A soft row gives way at this speed under what it bears, and must open as fast to hold it.
    const double yields = impulse * soft.impulse_share * inverse_or_zero(mass);
    wanted = std::min(-point.gap * soft.push_rate, std::max(point.opens_max, yields));
    impulse *= 1 - soft.impulse_share;
  }
  push(row, std::max(impulse + (wanted - velocity_of(row)) * mass, 0.0) - row.impulse);
}

double JointedContacts::load_of(const Patch& patch) {
  double load = 0;
  for (int n = 0; n < patch.points; ++n) load += patch.point[static_cast<std::size_t>(n)].row.impulse;
  return load;
}

// The impulse of the largest size that friction has, against the slip that is left: (K + k 1) impulse = K of
// what it is now - slide, with the k > 0 that gives it this size. A leg may be 10,000 times as yielding along
// its joints as across them, where steps of one size in all directions would not arrive. In principal
// directions.
Vector3d JointedContacts::slipping(const Patch& patch, const Vector3d& now, const Vector3d& slide,
                                   double most) {
  constexpr int kSteps = 8;
  if (most <= 0) return Vector3d::Zero();
  const Vector3d pull = patch.mobility.cwiseProduct(now) - slide;
  // Newton's method for 1 / size, which comes from below, and does not go beyond.
  double k = std::max(pull.norm() / most - patch.mobility.maxCoeff(), 0.0);
  Vector3d impulse = Vector3d::Zero();
  for (int step = 0; step < kSteps; ++step) {
    const Vector3d inverse =
        (patch.mobility.array() + k).unaryExpr([](double value) { return inverse_or_zero(value); });
    impulse = pull.cwiseProduct(inverse);
    const double slope = impulse.cwiseAbs2().dot(inverse);
    const double size = impulse.norm();
    if (!(size > most) || !(slope > 0)) break;
    k += impulse.squaredNorm() / slope * (size - most) / most;
  }
  const double size = impulse.norm();
  return size > most ? Vector3d(impulse * (most / size)) : impulse;
}

void JointedContacts::solve_friction(Patch& patch) {
  const double most = load_of(patch) * patch.friction;
  auto& [first, second, twist] = patch.rubbing;
  const Vector3d now = patch.principal.transpose() * Vector3d(first.impulse, second.impulse, twist.impulse);
  const Vector3d slide =
      patch.principal.transpose() * Vector3d(velocity_of(first), velocity_of(second), velocity_of(twist));
  const double least = kMobileShare * patch.mobility.maxCoeff();
  Vector3d wanted = now;
  for (Eigen::Index n = 0; n < 3; ++n) {
    if (patch.mobility(n) > least) wanted(n) -= slide(n) / patch.mobility(n);
  }
  if (wanted.squaredNorm() > most * most) wanted = slipping(patch, now, slide, most);
  const Vector3d impulse = patch.principal * wanted;
  push(first, impulse.x() - first.impulse);
  push(second, impulse.y() - second.impulse);
  push(twist, impulse.z() - twist.impulse);
}

void JointedContacts::solve_rolling(Patch& patch) {
  auto& [first, second] = patch.rolling;
  const std::array<double, 2> held = times(patch.rolling_mass, {velocity_of(first), velocity_of(second)});
  std::array<double, 2> wanted = {first.impulse - held[0], second.impulse - held[1]};
  const double scale = scale_within(wanted, load_of(patch) * patch.arm);
  push(first, wanted[0] * scale - first.impulse);
  push(second, wanted[1] * scale - second.impulse);
}

// What another solver has pushed, of which joints hold nothing, moves as it did not before.
void JointedContacts::find_struck() {
  for (Group& group : groups_) {
    if (group.assembly) continue;
    const auto first = velocities_.begin() + static_cast<std::ptrdiff_t>(group.first);
    group.is_struck =
        !std::equal(first, first + 6, noted_.begin() + static_cast<std::ptrdiff_t>(group.first));
  }
}

bool JointedContacts::is_struck(const Row& row) const {
  return std::ranges::any_of(row.group, [this](std::size_t n) { return n != kNone && groups_[n].is_struck; });
}

void JointedContacts::rebound() {
  if (is_empty()) return;
  load();
  find_struck();
  for (Cluster& cluster : clusters_) {
    if (!rebounds(cluster)) continue;
    const std::span<Patch> patches = patches_of(cluster);
    for_each_row(patches, [](Row& row) { row.before = row.impulse; });
    solve(cluster, [this](Patch& patch) { rebound(patch); });
    for_each_row(patches, [](Row& row) { row.total += row.impulse - row.before; });
  }
  store();
}

// What others do changes nothing here: even a pass that pushes nothing asks joints what they bear.
bool JointedContacts::rebounds(const Cluster& cluster) const {
  return cluster.may_bounce ||
         std::ranges::any_of(groups_of(cluster), [this](std::size_t n) { return groups_[n].is_struck; });
}

// As in the kernel of the contact solver.
void JointedContacts::rebound(Patch& patch) {
  const Softness& soft = softness_;
  const bool struck = is_struck(patch.rubbing[0]);
  bool is_active = struck;
  for (int n = 0; n < patch.points; ++n) {
    Point& point = patch.point[static_cast<std::size_t>(n)];
    Row& row = point.row;
    double speed = point.approach_max;
    bool bounces = false;
    if (patch.restitution > 0 && -point.before > patch.bounce_from &&
        row.total + (row.impulse - row.before) > 0) {
      const double approach = std::max(-velocity_of(row, noted_), 0.0);
      const double way = std::min(approach, -point.approach_max) * soft.time_step;
      const double met = std::sqrt(std::max(point.before * point.before - 2 * point.pull * way, 0.0));
      bounces = patch.restitution * met > 0;
      if (bounces) speed = patch.restitution * met;
    }
    if (!bounces && !struck) continue;
    is_active = true;
    const double more = std::max(row.impulse + (speed - velocity_of(row)) * row.mass, 0.0) - row.impulse;
    if (more == 0) continue;
    push(row, more);
    for (const std::size_t group : row.group) {
      if (group != kNone) groups_[group].is_struck = true;
    }
  }
  if (!is_active) return;
  solve_friction(patch);
  if (patch.arm > 0) solve_rolling(patch);
}

void JointedContacts::end(std::span<Given> patches) const {
  for (const Patch& patch : patches_) {
    Contacts::Patch& into = patches[patch.given].patch;
    into.mobility = 0;
    for (std::size_t n = 0; n < into.points; ++n) {
      into.point[n].impulse = patch.point[n].row.total;
      into.mobility = std::max(into.mobility, patch.point[n].row.mobility);
    }
    const auto& [first, second, twist] = patch.rubbing;
    into.friction_impulse = first.on[0].head<3>() * first.total + second.on[0].head<3>() * second.total;
    into.twist_impulse = twist.total * patch.radius;
    if (!into.surface) continue;
    const Vector3 rolling = patch.rolling[0].on[0].tail<3>() * patch.rolling[0].total +
                            patch.rolling[1].on[0].tail<3>() * patch.rolling[1].total;
    into.surface->rolling_impulse = rolling;
  }
}

}  // namespace tessera
