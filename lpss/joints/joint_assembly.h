// The bodies that joints connect, whose rows are solved at once (joint_solver.h).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "lpss/joints/held_rows.h"
#include "lpss/joints/joint_coupling.h"
#include "lpss/joints/joint_rows.h"

namespace tessera::joints {

// Three numbers of a contact solver, in its precision.
class SharedVector {
 public:
  SharedVector() = default;
  explicit SharedVector(float* numbers) : single_(numbers) {}
  explicit SharedVector(double* numbers) : double_(numbers) {}

  Eigen::Vector3d get() const;
  // Rounds to that precision.
  void set(const Eigen::Vector3d& value) const;

 private:
  float* single_ = nullptr;
  double* double_ = nullptr;
};

// The solver's data of a body.
struct JointedBody {
  double inverse_mass = 0;  // 1/kg; 0 for an immovable body, whose motion is in the rows
  Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Zero();  // world axes
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();           // m/s, at the start of the passes
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();          // rad/s
  SharedVector linear_change;  // since then; its numbers stay in place until the last pass
  SharedVector angular_change;
};

// Bodies by their indices in a list; a parent only if it is movable.
struct SolvedJoint {
  JointId id;
  int child;
  std::optional<int> parent;
  const JointProperties* properties;
  const JointDrives* drives;
  PosedJoint posed;
};

// How a body has come to move in a tick.
struct BodyMotion {
  int body;
  Eigen::Vector3d way;      // m
  Eigen::Quaterniond turn;  // world axes
  bool is_whole;            // or it comes on top of what the final velocities do
                            // `way` is not finite where the assembly has diverged
};

// Of a tick of `dt` seconds in so many steps, which share the bounds of impulses: for each step start_step()
// and passes, with a move() among them; or passes alone, where a tick is one step.
class JointAssembly {
 public:
  // `patterns` outlives it.
  JointAssembly(std::vector<SolvedJoint> joints, std::span<const JointedBody> bodies, double dt, int steps,
                KnownPatterns& patterns);

  void start_step();
  void pass();
  void move();
  void end(std::vector<BodyMotion>& moved);

 private:
  // A joint, with the indices of its bodies in bodies_.
  struct Tie {
    SolvedJoint joint;
    Eigen::Index child;
    std::optional<Eigen::Index> parent;
    std::vector<JointRow> rows;
  };

  // An axis that follows another one, with the ties of both.
  struct Link {
    JointCoupling coupling;
    std::size_t follower;
    std::size_t leader;
    std::array<JointRow, 2> rows;
  };

  // Velocities, and the impulses of soft rows that have made them in this step: held rows with a compliance.
  struct Motion {
    Eigen::VectorXd velocities;
    Eigen::VectorXd soft_impulses;  // by held row; 0 for others
    double gained = 0;  // J: by held rows that do not give way, beyond what immovable bodies put in
  };

  // A row over the velocities of all bodies whose impulses do not affect the held directions, but for those
  // of soft rows.
  struct FreeRow {
    Eigen::VectorXd row;
    Eigen::VectorXd response;     // of the velocities to a unit of impulse
    Eigen::VectorXd shares;       // of what is held, that were taken out of the row; of soft rows: 0
    Eigen::VectorXd soft_shares;  // of soft rows, that answer with so much impulse
    double mobility = 0;          // of the row's own velocity
    double velocity = 0;          // wanted of the row before
    double compliance = 0;
    double impulse_min = 0;
    double impulse_max = 0;
    double impulse = 0;
  };

  struct Body {
    JointedBody now;
    BodyMotion moved;
    Eigen::Vector3d linear_seen = Eigen::Vector3d::Zero();  // the changes that velocities_ have
    Eigen::Vector3d angular_seen = Eigen::Vector3d::Zero();
  };

  void add_links();
  bool has_loop() const;
  std::ptrdiff_t axes_with_rows() const;
  const PosedJoint& posed_of(std::size_t tie) const { return ties_[tie].joint.posed; }
  void find_whether_to_move();
  bool turns_beyond(double turn, const Eigen::VectorXd& velocities, double time) const;
  void make_rows();
  void make_tie_rows(Tie& tie);
  double parents_rate(const Tie& tie, const JointRow& row) const;
  void put_right();
  PosedJoint shifted(const Tie& tie, const Eigen::VectorXd& way) const;
  void shift_bodies(const Eigen::VectorXd& way);
  double weighed(const Eigen::VectorXd& errors) const;
  bool factorise();
  void make_nodes();
  void fill_held();
  Eigen::VectorXd over_bodies(const Tie& tie, const JointRow& row) const;
  Eigen::VectorXd answer_to(const Eigen::VectorXd& row) const;
  void add_free_rows();
  Eigen::VectorXd shares_of(const Eigen::VectorXd& row) const;
  void hold(Motion& motion) const;
  void push(Motion& motion, const FreeRow& free, double impulse) const;
  Eigen::VectorXd without_soft(Eigen::VectorXd held) const;
  std::vector<Eigen::Quaterniond> turns(const Eigen::VectorXd& velocities, double time) const;
  PosedJoint after(const Tie& tie, const Eigen::VectorXd& velocities, double time,
                   std::span<const Eigen::Quaterniond> turns) const;
  template <typename Posed>
  Eigen::VectorXd errors_of(const Posed& posed) const;
  Eigen::VectorXd bend(const Eigen::VectorXd& velocities) const;
  void hold_at_end(Motion& motion);
  double bent_energy_max(const Eigen::VectorXd& velocities) const;
  bool bend_back(Motion& motion);
  void look_ahead(Motion& motion);
  void make_held_rows_after(const Eigen::VectorXd& velocities);
  Eigen::VectorXd momenta_of(const Eigen::VectorXd& velocities) const;
  void advance();
  bool see_changes();
  void set_motion(const Motion& motion);
  bool gains_energy() const;

  std::vector<Tie> ties_;
  std::vector<Link> links_;  // their rows come after those of ties
  std::vector<Body> bodies_;
  int steps_;           // of the tick
  bool moves_ = false;  // from step to step
  double span_;         // s, over which rows hold: a tick, or a step of those that move
  KnownPatterns& patterns_;
  HeldRows held_;                // of ties, then of links
  Eigen::VectorXd wanted_;       // m/s, rad/s: the velocities of held rows, were nothing to turn
  Eigen::VectorXd errors_;       // m, rad: of held rows, at the start of the step; of soft rows: 0
  Eigen::VectorXd compliances_;  // velocity per impulse, of held rows: above 0 for soft ones
  Eigen::VectorXd is_soft_;      // 1 for soft rows, else 0; empty if there is none
  Eigen::VectorXd weights_;      // kg, kg m^2: of held rows
  Eigen::VectorXd bent_;         // m/s, rad/s: what it takes beyond the wanted velocities, since bodies turn
  Eigen::VectorXd bending_;      // impulses of that
  bool is_bent_ = false;         // they were set in this step
  bool is_held_ = false;         // the velocities, since the rows were made and others last changed one
  bool is_foreseen_ = true;      // and follow the velocities of each pass
  double gives_way_ = 0;         // the share by which rows do
  bool is_anchored_ = false;     // to something that cannot be pushed
  std::vector<FreeRow> free_rows_;
  Eigen::VectorXd velocities_;
  Eigen::VectorXd soft_impulses_;
  double gained_ = 0;  // J, in this tick
  bool is_settled_ = false;
  bool has_diverged_ = false;          // in this tick: nothing is solved any more
  std::vector<Eigen::VectorXd> ways_;  // the velocities of steps that bodies are still to be moved by
};

}  // namespace tessera::joints
