// Makes the rows of contacts of jointed bodies.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "lpss/islands/jointed_contacts.h"

namespace tessera {
namespace {

// Of an assembly of which contacts push more bodies, each is to them what it is without its joints: what they
// do to each other is a matrix.
constexpr std::size_t kTouchedMax = 24;

// Where joints leave less than this share of how bodies give way, they hold these themselves: what is left is
// rounding.
constexpr double kHeldShare = 1e-6;

// Two directions perpendicular to a unit vector and to each other.
std::array<Eigen::Vector3d, 2> plane_of(const Eigen::Vector3d& normal) {
  const bool is_steep = std::abs(normal.z()) > std::sqrt(0.5);
  const double x = is_steep ? normal.z() : normal.x();
  const double length = std::sqrt(x * x + normal.y() * normal.y());
  const double scale = length > 0 ? 1 / length : 0;
  const Eigen::Vector3d first = is_steep ? Eigen::Vector3d(0, -normal.z() * scale, normal.y() * scale)
                                         : Eigen::Vector3d(-normal.y() * scale, normal.x() * scale, 0);
  return {first, normal.cross(first)};
}

// Of a symmetric matrix (00, 01, 11); of what cannot move, 0.
std::array<double, 3> inverse_of(const std::array<double, 3>& matrix) {
  const auto inverse_or_zero = [](double value) { return value > 0 ? 1 / value : 0; };
  const auto& [k00, k01, k11] = matrix;
  const double factor = inverse_or_zero(k00 * k11 - k01 * k01);
  return {k11 > 0 ? k11 * factor : inverse_or_zero(k00), -k01 * factor,
          k00 > 0 ? k00 * factor : inverse_or_zero(k11)};
}

}  // namespace

void JointedContacts::clear() {
  patches_.clear();
  members_.clear();
  groups_.clear();
  clusters_.clear();
}

void JointedContacts::begin(const Softness& softness, joints::JointSolver& joints, FreeBodies& free,
                            std::span<const Contacts::Body> bodies, std::span<const std::size_t> jointed,
                            std::span<const Given> patches) {
  clear();
  softness_ = softness;
  free_ = &free;
  joints_ = &joints;
  bodies_ = bodies;
  jointed_ = jointed;
  member_of_place_.assign(bodies.size(), kNone);
  for (const Given& given : patches) {
    for (const std::size_t place : {given.patch.a, given.patch.b}) {
      if (bodies_[place].inverse_mass > 0) member_of(place);
    }
  }
  make_groups();
  make_clusters(patches);
  note_velocities();
}

std::size_t JointedContacts::member_of(std::size_t place) {
  std::size_t& member = member_of_place_[place];
  if (member != kNone) return member;
  member = members_.size();
  members_.push_back({place, {nullptr, 0}});
  if (!std::ranges::binary_search(jointed_, place)) return member;
  Member& jointed = members_.back();
  jointed.jointed = joints_->place_of(place);
  jointed.number = jointed.jointed.assembly->touch(jointed.jointed.body);
  return member;
}

void JointedContacts::make_groups() {
  std::size_t first = 0;
  const auto add_group = [&](joints::JointAssembly* assembly, std::size_t bodies) {
    groups_.push_back({assembly, first, 6 * bodies, false});
    first += 6 * bodies;
    return groups_.size() - 1;
  };
  for (Member& member : members_) {
    joints::JointAssembly* const assembly = member.jointed.assembly;
    if (!assembly || assembly->touched() > kTouchedMax) {
      member.group = add_group(nullptr, 1);
      member.number = 0;
      continue;
    }
    const auto known =
        std::ranges::find(groups_, assembly, [](const Group& group) { return group.assembly; });
    member.group = known != groups_.end() ? static_cast<std::size_t>(known - groups_.begin())
                                          : add_group(assembly, assembly->touched());
  }
  velocities_.assign(first, 0);
  wrenches_.assign(first, 0);
}

// Clusters in the order of their first patches. What cannot be pushed connects nothing.
void JointedContacts::make_clusters(std::span<const Given> patches) {
  connected_.reset(groups_.size());
  const auto group_of = [this](std::size_t place) {
    const std::size_t member = member_of_place_[place];
    return member == kNone ? kNone : members_[member].group;
  };
  for (const Given& given : patches) {
    const std::size_t a = group_of(given.patch.a);
    const std::size_t b = group_of(given.patch.b);
    if (a != kNone && b != kNone) connected_.unite(a, b);
  }
  for (Group& group : groups_) group.cluster = kNone;
  const auto cluster_of = [&](const Contacts::Patch& patch) -> std::size_t& {
    return groups_[connected_.find(group_of(group_of(patch.a) != kNone ? patch.a : patch.b))].cluster;
  };
  for (const Given& given : patches) {
    std::size_t& cluster = cluster_of(given.patch);
    if (cluster == kNone) {
      cluster = clusters_.size();
      clusters_.emplace_back();
    }
    ++clusters_[cluster].count;
  }
  std::size_t first = 0;
  for (Cluster& cluster : clusters_) {
    cluster.first = first;
    first += cluster.count;
    cluster.count = 0;
  }
  patches_.resize(first);
  for (std::size_t n = 0; n < patches.size(); ++n) {
    Cluster& cluster = clusters_[cluster_of(patches[n].patch)];
    Patch& patch = patches_[cluster.first + cluster.count++];
    fill(patches[n], patch);
    patch.given = n;
    cluster.may_bounce = cluster.may_bounce || patch.may_bounce;
  }
  for (std::size_t n = 0; n < groups_.size(); ++n) {
    groups_[n].cluster = groups_[connected_.find(n)].cluster;
    ++clusters_[groups_[n].cluster].groups;
  }
  number_rows();
}

void JointedContacts::number_rows() {
  std::size_t first_group = 0;
  std::size_t first_matrix = 0;
  std::size_t first_answer = 0;
  for (Cluster& cluster : clusters_) {
    cluster.first_group = first_group;
    first_group += cluster.groups;
    cluster.groups = 0;
    for_each_row(patches_of(cluster), [&](Row& row) {
      row.number = cluster.rows++;
      first_answer = place_answers(row, first_answer);
    });
    if (cluster.rows > kRowsAtOnceMax) continue;
    cluster.matrix = first_matrix;
    first_matrix += cluster.rows * padded(cluster.rows);
  }
  matrices_.assign(first_matrix, 0);
  answers_.resize(first_answer);
  groups_of_clusters_.resize(first_group);
  for (std::size_t n = 0; n < groups_.size(); ++n) {
    Cluster& cluster = clusters_[groups_[n].cluster];
    groups_of_clusters_[cluster.first_group + cluster.groups++] = n;
  }
}

// From a place in answers_ on; the next free one.
std::size_t JointedContacts::place_answers(Row& row, std::size_t first) const {
  for (std::size_t g = 0; g < 2; ++g) {
    if (row.group[g] == kNone) continue;
    const Group& group = groups_[row.group[g]];
    row.answer[g] = {first, group.first, group.size / 6};
    first += group.size;
  }
  return first;
}

void JointedContacts::set_sides(const Contacts::Patch& from, Row& row) const {
  const std::array<std::size_t, 2> places = {from.a, from.b};
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t n = member_of_place_[places[side]];
    if (n == kNone) {
      const Contacts::Body& body = bodies_[places[side]];
      row.drive += row.on[side].head<3>().dot(body.linear) + row.on[side].tail<3>().dot(body.angular);
      continue;
    }
    const Member& member = members_[n];
    const Contacts::Body& body = bodies_[member.place];
    const Vector3 turn = row.on[side].tail<3>();
    row.free_mobility +=
        row.on[side].head<3>().squaredNorm() * body.inverse_mass + turn.dot(body.inverse_inertia * turn);
    row.group[side] = member.group;
    row.at[side] = groups_[member.group].first + 6 * member.number;
  }
  if (row.group[0] == row.group[1]) row.group[1] = kNone;
}

JointedContacts::Row JointedContacts::row_of(const Contacts::Patch& from, const Vector3& direction,
                                             const Vector3& lever_a, const Vector3& lever_b) const {
  Row row;
  row.on[0] << direction, lever_a.cross(direction);
  row.on[1] << -direction, -lever_b.cross(direction);
  set_sides(from, row);
  return row;
}

JointedContacts::Row JointedContacts::turn_row_of(const Contacts::Patch& from, const Vector3& axis) const {
  Row row;
  row.on[0] << Vector3::Zero(), axis;
  row.on[1] << Vector3::Zero(), -axis;
  set_sides(from, row);
  return row;
}

void JointedContacts::fill(const Given& given_patch, Patch& patch) {
  const Contacts::Patch& from = given_patch.patch;
  patch = {};
  patch.points = static_cast<int>(from.points);
  patch.friction = from.friction;
  patch.restitution = from.restitution;
  patch.bounce_from = double(given_patch.bounce_from);
  const double share = softness_.share;
  for (std::size_t n = 0; n < from.points; ++n) {
    const auto& given = from.point[n];
    Point& point = patch.point[n];
    point.row = row_of(from, given.normal, given.lever_a, given.lever_b);
    point.gap = given.gap;
    point.approach_max = std::min(-point.gap / softness_.time_step, 0.0);
    point.row.impulse = given.impulse * share;
    point.before = point.row.drive;
    const std::array<std::size_t, 2> places = {from.a, from.b};
    for (std::size_t side = 0; side < 2; ++side) {
      if (point.row.at[side] == kNone) continue;
      const Contacts::Body& body = bodies_[places[side]];
      const Wrench& on = point.row.on[side];
      point.before += on.head<3>().dot(body.linear) + on.tail<3>().dot(body.angular);
      point.pull += on.head<3>().dot(body.linear_force) + on.tail<3>().dot(body.angular_force);
    }
    point.pull /= softness_.time_step;
    patch.may_bounce = patch.may_bounce || (patch.restitution > 0 && -point.before > patch.bounce_from);
  }
  make_friction(from, patch);
  patch.course = from.course;
  if (!patch.course) return;
  add_course(patch, patch.course->linear, patch.course->angular);
  for (std::size_t n = 0; n < from.points; ++n) {
    Point& point = patch.point[n];
    point.before +=
        point.row.on[0].head<3>().dot(patch.course->linear + patch.course->angular.cross(point.arm));
  }
}

// What the surface of a moves by past that of b, beyond what the velocities of the bodies say.
void JointedContacts::add_course(Patch& patch, const Vector3& linear, const Vector3& angular) {
  for (int n = 0; n < patch.points; ++n) {
    Point& point = patch.point[static_cast<std::size_t>(n)];
    point.row.drive += point.row.on[0].head<3>().dot(linear + angular.cross(point.arm));
  }
  for (std::size_t k = 0; k < 2; ++k) patch.rubbing[k].drive += patch.rubbing[k].on[0].head<3>().dot(linear);
  patch.rubbing[2].drive += patch.rubbing[2].on[0].tail<3>().dot(angular);
  for (Row& row : patch.rolling) row.drive += row.on[0].tail<3>().dot(angular);
}

// As the kernel of the contact solver makes it: at the centre of the points, in tangents that are scaled
// where friction differs by direction.
void JointedContacts::make_friction(const Contacts::Patch& from, Patch& patch) const {
  Vector3 lever_a = Vector3::Zero();
  Vector3 lever_b = Vector3::Zero();
  Vector3 normal = Vector3::Zero();
  double load = 0;
  for (std::size_t n = 0; n < from.points; ++n) {
    lever_a += from.point[n].lever_a / double(from.points);
    lever_b += from.point[n].lever_b / double(from.points);
    normal += from.point[n].normal;
    load += patch.point[n].row.impulse;
  }
  for (std::size_t n = 0; n < from.points; ++n) patch.point[n].arm = from.point[n].lever_a - lever_a;
  normal *= inverse_or_zero(normal.norm());
  const bool is_by_a = bodies_[from.a].inverse_mass > 0;
  for (std::size_t n = 0; n < from.points; ++n) {
    const Vector3 arm =
        is_by_a ? Vector3(from.point[n].lever_a - lever_a) : Vector3(from.point[n].lever_b - lever_b);
    patch.radius += arm.norm() / double(from.points);
  }
  const std::array<Vector3, 2> plane = plane_of(normal);
  std::array<Vector3, 2> tangents = plane;
  const auto* const surface = from.surface;
  if (surface) {
    const Vector3 given = surface->direction;
    const Vector3 flat = given - normal * given.dot(normal);
    const bool is_flat = flat.squaredNorm() > 1e-6;
    const auto along = surface->along;
    const auto across = surface->across;
    patch.share =
        is_flat ? std::array{along, across} : std::array{std::min(along, across), std::min(along, across)};
    if (is_flat) tangents = {flat.normalized(), normal.cross(flat.normalized())};
    patch.radius += std::min(surface->torsion * inverse_or_zero(patch.friction), kTwistArmMax);
    patch.arm = surface->rolling;
  }
  const double share = softness_.share;
  const Vector3 last = from.friction_impulse * share;
  std::array<double, 2> impulse;
  for (std::size_t k = 0; k < 2; ++k) {
    const Vector3 tangent = tangents[k] * patch.share[k];
    patch.rubbing[k] = row_of(from, tangent, lever_a, lever_b);
    if (surface) patch.rubbing[k].drive += tangent.dot(surface->drift);
    impulse[k] = last.dot(tangent) * inverse_or_zero(patch.share[k] * patch.share[k]);
    patch.rolling[k] = turn_row_of(from, plane[k]);
    if (surface) patch.rolling[k].impulse = plane[k].dot(surface->rolling_impulse) * share;
  }
  const double most = load * patch.friction;
  const double scale = scale_within(impulse, most);
  for (std::size_t k = 0; k < 2; ++k) patch.rubbing[k].impulse = impulse[k] * scale;
  const double rolling = scale_within({patch.rolling[0].impulse, patch.rolling[1].impulse}, load * patch.arm);
  for (Row& row : patch.rolling) row.impulse *= rolling;
  const double slid = scale * std::sqrt(impulse[0] * impulse[0] + impulse[1] * impulse[1]);
  const double left = std::sqrt(std::max(most * most - slid * slid, 0.0));
  patch.rubbing[2] = turn_row_of(from, normal * patch.radius);
  patch.rubbing[2].impulse =
      std::clamp(from.twist_impulse * share * inverse_or_zero(patch.radius), -left, left);
}

// Asks assemblies what they have become. Of this cluster alone: masses that vanish take impulses with them.
void JointedContacts::update_answers(Cluster& cluster) {
  for (const std::size_t n : groups_of(cluster)) {
    joints::JointAssembly* const assembly = groups_[n].assembly;
    if (assembly && assembly->update_response()) cluster.has_answers = false;
  }
  if (cluster.has_answers) return;
  cluster.has_answers = true;
  const std::span<Patch> patches = patches_of(cluster);
  for_each_row(patches, [this](Row& row) { make_answer(row); });
  for (Patch& patch : patches) make_masses(patch);
  if (cluster.matrix != kNone) make_matrix(cluster);
}

void JointedContacts::make_matrix(const Cluster& cluster) {
  const std::span<Patch> patches = patches_of(cluster);
  double* answer = matrices_.data() + cluster.matrix;
  for_each_row(patches, [&](const Row& by) {
    for_each_row(patches, [&](const Row& row) { answer[row.number] = answer_of(row, by); });
    answer += padded(cluster.rows);
  });
}

void JointedContacts::make_answer(Row& row) {
  for (std::size_t g = 0; g < 2; ++g) {
    if (row.group[g] == kNone) continue;
    const Group& group = groups_[row.group[g]];
    Eigen::Map<Eigen::VectorXd> answer(answers_.data() + row.answer[g].first,
                                       static_cast<Eigen::Index>(group.size));
    answer.setZero();
    for (std::size_t side = 0; side < 2; ++side) {
      if (row.at[side] == kNone || row.at[side] < group.first || row.at[side] >= group.first + group.size)
        continue;
      const Wrench& on = row.on[side];
      if (group.assembly) {
        const auto column = static_cast<Eigen::Index>(row.at[side] - group.first);
        answer.noalias() += group.assembly->response().middleCols<6>(column).lazyProduct(on);
        continue;
      }
      const auto is_of_group = [&](const Member& member) { return &groups_[member.group] == &group; };
      const Contacts::Body& body = bodies_[std::ranges::find_if(members_, is_of_group)->place];
      answer.head<3>() += on.head<3>() * body.inverse_mass;
      answer.tail<3>() += body.inverse_inertia * on.tail<3>();
    }
  }
}

// By how much a unit of impulse along `by` changes the velocity along `row`, of the same two bodies.
double JointedContacts::answer_of(const Row& row, const Row& by) const {
  double sum = 0;
  for (std::size_t g = 0; g < 2; ++g) {
    if (by.group[g] == kNone) continue;
    const Group& group = groups_[by.group[g]];
    for (std::size_t side = 0; side < 2; ++side) {
      if (row.at[side] == kNone || row.at[side] < group.first || row.at[side] >= group.first + group.size)
        continue;
      sum += row.on[side].dot(
          Eigen::Map<const Wrench>(answers_.data() + by.answer[g].first + row.at[side] - group.first));
    }
  }
  return sum;
}

// Of two rows of the same two bodies: the symmetric matrix of what they do to each other (00, 01, 11).
std::array<double, 3> JointedContacts::mobility_of(const Row& first, const Row& second) const {
  const double both = first.mobility > 0 && second.mobility > 0 ? answer_of(first, second) : 0;
  return {first.mobility, both, second.mobility};
}

// As an axis returns from beyond a limit: where joints leave little of how the bodies give way, what moves
// with them would be thrown.
double JointedContacts::opening_max(const Row& row) {
  if (!(row.mobility > 0)) return 0;
  return joints::kReturnSpeed * std::sqrt(std::min(row.mobility / row.free_mobility, 1.0));
}

void JointedContacts::make_masses(Patch& patch) {
  const auto set_mass = [this](Row& row) {
    row.mobility = answer_of(row, row);
    if (!(row.mobility > kHeldShare * row.free_mobility)) row.mobility = row.impulse = 0;
    row.mass = inverse_or_zero(row.mobility);
  };
  for (Row& row : patch.rubbing) set_mass(row);
  if (patch.arm > 0) {
    for (Row& row : patch.rolling) set_mass(row);
  }
  for (int n = 0; n < patch.points; ++n) {
    Point& point = patch.point[static_cast<std::size_t>(n)];
    set_mass(point.row);
    point.opens_max = opening_max(point.row);
  }
  Eigen::Matrix3d mobility = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Row& by = patch.rubbing[static_cast<std::size_t>(k)];
    mobility(k, k) = by.mobility;
    for (Eigen::Index n = 0; n < k; ++n) {
      const Row& row = patch.rubbing[static_cast<std::size_t>(n)];
      if (row.mobility > 0 && by.mobility > 0) mobility(k, n) = mobility(n, k) = answer_of(row, by);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(mobility);
  patch.principal = axes.eigenvectors();
  patch.mobility = axes.eigenvalues().cwiseMax(0);
  if (patch.arm > 0) patch.rolling_mass = inverse_of(mobility_of(patch.rolling[0], patch.rolling[1]));
}

}  // namespace tessera
