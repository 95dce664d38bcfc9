// Solves the contacts of bodies that joints hold, in turns with what solves these joints.
//
// To such a contact a body is not its own mass and inertia, but what its joints leave of them: a wheel
// carries a car, and a finger cannot turn. So each row knows what a unit of its impulse does to all bodies of
// an assembly that contacts touch, with joints holding, and also drives, limits and friction as far as they
// do (joints::JointAssembly::response()). A pass goes over all patches until they settle,
// which finds how an assembly rests on many contacts; then joints answer to all of its pushes at once.
// Contacts that rest on what joints have not answered for yet would otherwise give up, pass by pass, what
// they bear.
//
// The rows are those of ContactSolver, in double precision, whatever the engine computes with.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "lpss/base/disjoint_sets.h"
#include "lpss/joints/joint_solver.h"
#include "lpss/solver/contact_solver.h"

namespace tessera {

// The velocities of bodies that no joint holds, by place: as a solver of contacts has them, in its precision.
class FreeBodies {
 public:
  using Velocities = joints::JointAssembly::Velocities;  // m/s, rad/s

  virtual Velocities change(std::size_t place) const = 0;  // since before the tick
  virtual void push(std::size_t place, const Velocities& change) = 0;

 protected:
  ~FreeBodies() = default;
};

// One set of islands at a time, between begin() and end() of both other solvers, in whose steps it takes its
// turns. The order of patches is that of the task, so that an island's bits do not depend on others. Keeps
// its storage.
class JointedContacts {
 public:
  using Contacts = SolverTypes<double>;

  // A patch of a jointed body, with its impulses.
  struct Given {
    Contacts::Patch patch;
    std::size_t place = 0;   // among all patches
    double bounce_from = 0;  // m/s: the approach from which its points bounce
  };

  // See ContactRows.
  struct Softness {
    double time_step = 0;
    double share = 0;
    double step = 0;
    double push_rate = 0;
    double impulse_share = 0;
    double mass_share = 0;
  };

  bool is_empty() const { return patches_.empty(); }

  // Takes the patches of bodies that joints hold, in the order of the islands; to be called after begin() of
  // the other solver of contacts, and set_up() of `joints`. Both, and `free`, live on until end().
  // `bodies`: by place, of those that the patches touch. `jointed`: the places of bodies that joints hold,
  // ascending.
  void begin(const Softness& softness, joints::JointSolver& joints, FreeBodies& free,
             std::span<const Contacts::Body> bodies, std::span<const std::size_t> jointed,
             std::span<const Given> patches);
  void clear();

  // The impulses of the step before, on velocities that have the forces of this one.
  void start_step();
  // Contacts as they would hold and rub were nothing to be opened; to be called before passes that open.
  void settle();
  void open();   // pass(true) of the other solver ...
  void relax();  // ... and pass(false)
  // How bodies move in this step; how they move before they rebound.
  void note_velocities();
  void rebound();
  bool may_bounce() const { return std::ranges::any_of(clusters_, &Cluster::may_bounce); }

  // Impulses into those of begin().
  void end(std::span<Given> patches) const;

 private:
  using Vector3 = Eigen::Vector3d;
  using Wrench = Eigen::Matrix<double, 6, 1>;
  static constexpr std::size_t kNone = ~std::size_t{0};

  // More rows of a cluster push bodies, whose velocities each row then asks for: what rows do to each other
  // is a matrix. A multiple of what is padded to.
  static constexpr std::size_t kRowsAtOnceMax = 64;

  // Bodies that push each other without a contact: those of an assembly that contacts touch, or one body.
  struct Group {
    joints::JointAssembly* assembly = nullptr;
    std::size_t first = 0;  // number of its velocities, 6 a body
    std::size_t size = 0;
    std::size_t cluster = 0;
    bool is_struck = false;  // by a rebound
  };
  // What contacts connect: solved as if alone.
  struct Cluster {
    std::size_t first = 0;  // patch
    std::size_t count = 0;
    std::size_t first_group = 0;  // in groups_of_clusters_
    std::size_t groups = 0;
    std::size_t rows = 0;
    // In matrices_: what a unit of impulse of each row does to the velocity of each, row by row; kNone for
    // many rows, which push bodies.
    std::size_t matrix = kNone;
    bool has_answers = false;  // as its assemblies are
    bool may_bounce = false;   // a patch
  };
  struct Member {
    std::size_t place;
    joints::JointSolver::Place jointed;  // no assembly: of no joint
    std::size_t group = kNone;
    std::size_t number = 0;  // in it
  };

  // What a unit of impulse does to the velocities of a group.
  struct Answer {
    std::size_t first = 0;     // in answers_
    std::size_t velocity = 0;  // the first one
    std::size_t bodies = 0;    // 6 numbers each
  };

  // A direction in which two bodies move relative to each other.
  struct Row {
    std::array<Wrench, 2> on;                        // sides: what a unit of impulse is to them
    std::array<std::size_t, 2> at = {kNone, kNone};  // of their velocities; none of what cannot be pushed
    std::array<std::size_t, 2> group = {kNone, kNone};
    std::size_t number = 0;        // in its cluster
    std::array<Answer, 2> answer;  // of each group
    double drive = 0;              // m/s or rad/s, of what cannot be pushed, and of surfaces
    double free_mobility = 0;      // were nothing to hold the bodies
    double mobility = 0;           // what a unit of impulse changes of the velocity
    double mass = 0;               // its inverse
    double impulse = 0;            // of a step
    double total = 0;              // of all steps
    double before = 0;             // impulse, before a rebound
  };
  struct Point {
    Row row;
    double gap = 0;                 // m, in this step
    double opens_max = 0;           // m/s, at which an overlap is opened
    double approach_max = 0;        // m/s, at most 0: what closes the gap by the end of the tick
    double before = 0;              // m/s, before the tick
    double pull = 0;                // m/s^2, of forces
    Vector3 arm = Vector3::Zero();  // m, from the centre of the points
  };
  struct Patch {
    std::size_t given = 0;  // among those of begin()
    int points = 0;
    std::array<Point, kPatchPointsMax> point;
    // Both tangents, and the twist about the normal as the speed at `radius`.
    std::array<Row, 3> rubbing;
    Eigen::Matrix3d principal = Eigen::Matrix3d::Identity();  // columns: directions of their mobilities, ...
    Vector3 mobility = Vector3::Zero();                       // and these
    std::array<Row, 2> rolling;
    std::array<double, 3> rolling_mass = {};
    std::array<double, 2> share = {1, 1};  // by which tangents are scaled
    double friction = 0;
    double restitution = 0;
    double bounce_from = 0;
    bool may_bounce = false;  // a point meets fast enough
    const Contacts::Course* course = nullptr;
    double radius = 0;  // m, the arm of the twist
    double arm = 0;     // m, of rolling
  };
  std::size_t member_of(std::size_t place);
  void make_groups();
  void make_clusters(std::span<const Given> patches);
  void fill(const Given& given, Patch& patch);
  Row row_of(const Contacts::Patch& from, const Vector3& direction, const Vector3& lever_a,
             const Vector3& lever_b) const;
  Row turn_row_of(const Contacts::Patch& from, const Vector3& axis) const;
  void set_sides(const Contacts::Patch& from, Row& row) const;
  void make_friction(const Contacts::Patch& from, Patch& patch) const;
  static void add_course(Patch& patch, const Vector3& linear, const Vector3& angular);
  void number_rows();
  std::size_t place_answers(Row& row, std::size_t first) const;
  void make_matrix(const Cluster& cluster);
  void make_answer(Row& row);
  static double opening_max(const Row& row);
  void make_masses(Patch& patch);
  double answer_of(const Row& row, const Row& by) const;
  std::array<double, 3> mobility_of(const Row& first, const Row& second) const;

  void load();
  void store();
  Wrench velocities_of(const Member& member) const;
  void update_answers(Cluster& cluster);
  template <typename Act>
  void solve(Act act);
  template <typename Act>
  void solve(Cluster& cluster, Act act);
  template <typename Act>
  void go_over(std::span<Patch> patches, Act act);
  bool bears(const Cluster& cluster) const;
  std::span<Patch> patches_of(const Cluster& cluster) {
    return std::span(patches_).subspan(cluster.first, cluster.count);
  }
  std::span<const std::size_t> groups_of(const Cluster& cluster) const {
    return std::span(groups_of_clusters_).subspan(cluster.first_group, cluster.groups);
  }
  // Of a row in a matrix: whole registers.
  static std::size_t padded(std::size_t rows) { return (rows + 3) / 4 * 4; }
  template <typename Act>
  static void for_each_row(std::span<Patch> patches, Act act) {
    for (Patch& patch : patches) {
      for (int n = 0; n < patch.points; ++n) act(patch.point[static_cast<std::size_t>(n)].row);
      for (Row& row : patch.rubbing) act(row);
      if (patch.arm > 0) {
        for (Row& row : patch.rolling) act(row);
      }
    }
  }
  static double load_of(const Patch& patch);
  static double inverse_or_zero(double value) { return value > 0 ? 1 / value : 0; }
  // What brings a vector within a length.
  static double scale_within(const std::array<double, 2>& v, double most) {
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1]);
    return length > most ? most / length : 1;
  }
  double velocity_of(const Row& row) const {
    return matrix_ != nullptr ? row_velocities_[row.number] : velocity_of(row, velocities_);
  }
  double velocity_of(const Row& row, const std::vector<double>& velocities) const;
  void push(Row& row, double impulse);
  void push_bodies(const Row& row, double impulse);
  void add_wrench(const Row& row, double impulse);
  void start(const Cluster& cluster);
  void restart(const Cluster& cluster);
  void solve_point(Point& point, bool biased);
  static Vector3 slipping(const Patch& patch, const Vector3& now, const Vector3& slide, double most);
  void solve_friction(Patch& patch);
  void solve_rolling(Patch& patch);
  void find_struck();
  bool is_struck(const Row& row) const;
  bool rebounds(const Cluster& cluster) const;
  void rebound(Patch& patch);

  Softness softness_;
  FreeBodies* free_ = nullptr;
  joints::JointSolver* joints_ = nullptr;
  std::span<const Contacts::Body> bodies_;
  std::span<const std::size_t> jointed_;
  std::vector<std::size_t> member_of_place_;
  std::vector<Member> members_;
  std::vector<Group> groups_;
  std::vector<Patch> patches_;  // by cluster, in each in the order of the task
  std::vector<Cluster> clusters_;
  std::vector<std::size_t> groups_of_clusters_;
  DisjointSets connected_;
  double moved_ = 0;  // m/s or rad/s: what a push has changed most along its row
  std::vector<double> answers_;
  std::vector<double> matrices_;
  std::vector<double> velocities_;  // m/s, rad/s
  std::vector<double> noted_;       // of note_velocities()
  std::vector<double> wrenches_;    // N s, N m s, of a pass
  std::vector<double> loaded_;      // velocities before a pass
  std::vector<double> impulses_;    // of rows, before a pass
  // Of the cluster that is solved, if it has a matrix.
  const double* matrix_ = nullptr;
  std::size_t matrix_row_ = 0;  // numbers of a row
  std::array<double, kRowsAtOnceMax> row_velocities_ = {};
};

}  // namespace tessera
