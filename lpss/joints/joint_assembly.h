// The bodies that joints connect, whose rows are solved at once (joint_solver.h).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "lpss/base/disjoint_sets.h"
#include "lpss/joints/held_rows.h"
#include "lpss/joints/joint_coupling.h"
#include "lpss/joints/joint_loads.h"
#include "lpss/joints/joint_rows.h"
#include "lpss/joints/rotor.h"
#include "lpss/joints/small_system.h"

namespace tessera::joints {

// A body for a tick.
struct JointedBody {
  double inverse_mass = 0;  // 1/kg; 0 for an immovable body, whose motion is in the rows
  Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Zero();  // world axes
  Eigen::Vector3d inverse_moments = Eigen::Vector3d::Zero();  // about the axes of the body frame
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();           // m/s, before the first step
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();          // rad/s
  Eigen::Vector3d linear_force = Eigen::Vector3d::Zero();     // m/s, what forces add in the tick
  Eigen::Vector3d angular_force = Eigen::Vector3d::Zero();    // rad/s
};

// Bodies by their indices in a list; a parent only if it is movable.
struct SolvedJoint {
  JointId id;
  int child;
  std::optional<int> parent;
  const JointForm* form;
  const JointDrives* drives;
  PosedJoint posed;
  std::size_t place = 0;  // among those of the solver
};

// How a body has come to move in a tick.
struct BodyMotion {
  int body;
  // m. Where the assembly has diverged, not a number; or it is velocity_of_gained_energy().
  Eigen::Vector3d way;
  Eigen::Quaterniond turn;                            // world axes
  bool is_whole;                                      // or it comes on top of what the final velocities do
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();   // m/s, at the end
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  // rad/s
};

// For each tick clear(), add() and begin(); then for each step start_step(), passes with a move() among them,
// and end_step(); or passes alone, where a tick is one step. It has the velocities of its bodies, which
// others push() between its passes. What it needs of memory stays with it: a tick like the one before
// allocates nothing.
class JointAssembly {
 public:
  // `patterns` outlives it.
  explicit JointAssembly(KnownPatterns& patterns) : patterns_(patterns) {}

  void clear();

  // `places`: of all bodies, where kNoPlace means that the assembly does not have it yet.
  void add(const SolvedJoint& joint, std::span<const JointedBody> bodies, std::span<Eigen::Index> places);
  static constexpr Eigen::Index kNoPlace = -1;

  // A tick of `dt` seconds in so many steps, which share the bounds of impulses.
  void begin(double dt, int steps);

  // m/s, rad/s: of a body at this moment ...
  using Velocities = Eigen::Matrix<double, 6, 1>;
  Velocities velocities(Eigen::Index body) const { return velocities_.segment<6>(kBodyNumbers * body); }
  // ... and what others than joints add to them.
  void push(Eigen::Index body, const Velocities& change);
  bool is_pushed() const { return awaits_answer_; }  // since a pass

  // What contacts know of it. touch() gives numbers, from 0 on, to the bodies that they push: after begin(),
  // and before the first step.
  std::size_t touch(Eigen::Index body);
  std::size_t touched() const { return touched_.size(); }

  // How the velocities of touched bodies answer to wrenches on them, 6 by 6 numbers for each two: linear,
  // angular. Meanwhile joints hold as they are at the start of the tick, or as look_ahead() has found that
  // they will be; and so does what drives, limits and rubs within its bounds. update_response() is false if
  // it is as it was at the last call; to be asked for after passes.
  bool update_response();
  const Eigen::MatrixXd& response() const { return response_; }

  // Whether what holds along free axes bears these wrenches on touched bodies, too. What does not is taken to
  // give way until the next pass: update_response() tells what that changes.
  bool bears(std::span<const double> wrenches);

  // Forces of a step act; limits, drives and friction, too, as they did at the end of the step before.
  void start_step();
  void pass();
  // The velocities are those that bodies move by in this step ...
  void move();
  // ... and these are those that stay of it.
  void end_step();
  void end(std::vector<BodyMotion>& moved);

  // Once it has ended: what its joints gave and bore in steps, as impulses of the tick (N s, N m s), by the
  // places of joints.
  void write_impulses(std::span<JointLoads> impulses) const;

 private:
  // m or rad, of the way of a step: what changes by less is settled.
  static constexpr double kSettled = 1e-8;

  // A joint, with the indices of its bodies in bodies_.
  struct Tie {
    SolvedJoint joint;
    Eigen::Index child;
    std::optional<Eigen::Index> parent;
    std::vector<JointRow> rows;
    Eigen::Index held = 0;             // of them, the first ones
    JointPoses shifted;                // where errors might be corrected to
    JointLoads impulses;               // of the tick, so far
    std::array<double, 2> rates = {};  // of axes with an armature, as the step begins; rad/s or m/s
  };

  // A body that hangs on one joint alone, once those before it are taken off.
  struct End {
    std::size_t tie;
    bool is_child;  // of the joint
  };

  // An axis that follows another one, with the ties of both.
  struct Link {
    JointCoupling coupling;
    std::size_t follower;
    std::size_t leader;
    std::array<JointRow, 2> rows;
  };

  // A held row with an armature, which resists a change of the rate as a damper resists the rate.
  struct Armature {
    std::size_t tie;
    std::size_t row;  // of the tie
    Eigen::Index held;
    double yields;  // 1 / velocity per impulse, of spring and damper alone
  };

  // Velocities, and the impulses of soft rows that have made them in this step: held rows with a compliance.
  struct Motion {
    Eigen::VectorXd velocities;
    Eigen::VectorXd soft_impulses;  // by held row; 0 for others
    double gained = 0;  // J: by held rows that do not give way, beyond what immovable bodies put in
  };

  // The motion of an axis over the velocities of all bodies, whose impulses do not affect the held
  // directions, but for those of soft rows.
  struct FreeDirection {
    const Tie* tie = nullptr;
    const JointRow* axis = nullptr;
    Eigen::VectorXd row;
    Eigen::VectorXd response;     // of the velocities to a unit of impulse
    Eigen::VectorXd shares;       // of what is held, that were taken out of the row; of soft rows: 0
    Eigen::VectorXd soft_shares;  // of soft rows, that answer with so much impulse
    double whole = 0;             // mobility of the axis, were nothing held
    double mobility = 0;          // of the row's own velocity
  };

  // What drives, limits or rubs along one.
  struct FreeRow {
    const JointRow* row = nullptr;
    std::size_t direction = 0;
    double velocity = 0;  // wanted of the axis
    double compliance = 0;
    double impulse_min = 0;
    double impulse_max = 0;
    double impulse = 0;
  };

  // Several rows over all velocities, side by side.
  struct RowsAtOnce {
    Sides rows;
    Sides answers;      // of the velocities, to a unit of impulse of each
    Sides shares;       // of what is held, that were taken out of rows
    Sides soft_shares;  // of soft rows, that answer with so much impulse
  };

  // Of rotors, with or without those about their axes. What other joints than screws hold does not depend on
  // these, but its directions would turn with a parent.
  enum class Turns { kWhole, kTilts };
  static Turns turns_for(const Tie& tie) {
    return tie.joint.form->type == JointType::kScrew ? Turns::kWhole : Turns::kTilts;
  }

  // Of each body.
  struct BodyTurns {
    std::vector<Eigen::Quaterniond> whole;
    std::vector<Eigen::Quaterniond> tilts;  // where there are rotors

    std::span<const Eigen::Quaterniond> of(Turns which) const {
      return which == Turns::kTilts && !tilts.empty() ? tilts : whole;
    }
  };

  struct Body {
    JointedBody now;
    BodyMotion moved;
    std::optional<Eigen::Matrix3d> inertia;  // kg m^2; of `now`, once it was asked for
    RotorSearch rotor;
    std::optional<Eigen::Vector3d> spin_axis;                 // of a rotor, world axes
    Eigen::Vector3d beyond_middle = Eigen::Vector3d::Zero();  // N m s: momentum_beyond_middle()
    Eigen::Vector3d began_beyond = Eigen::Vector3d::Zero();   // likewise, when the step began
  };

  void add_links();
  bool has_loop();
  std::ptrdiff_t axes_with_rows() const;
  const PosedJoint& posed_of(std::size_t tie) const { return ties_[tie].joint.posed; }
  void find_rotors();
  void find_whether_to_move();
  bool turns_beyond(double turn, const Eigen::VectorXd& velocities, double time) const;
  void make_rows();
  void make_tie_rows(Tie& tie);
  double parents_rate(const Tie& tie, const JointRow& row) const;
  double rate_of(const Tie& tie, const JointRow& row) const;
  void note_rates();
  void aim_armatures();
  void put_right();
  JointPoses shifted(const Tie& tie, const Eigen::VectorXd& way,
                     std::span<const Eigen::Quaterniond> turns) const;
  void shift_bodies(const Eigen::VectorXd& way, std::span<const Eigen::Quaterniond> turns);
  double weighed(const Eigen::VectorXd& errors) const;
  bool factorise();
  void make_nodes();
  void fill_held();
  void find_answers(const Sides& rows, Sides& answers) const;
  void add_free_rows();
  std::size_t direction_of(const Tie& tie, const JointRow& row);
  void make_directions(std::span<FreeDirection> directions);
  void take_out_held(RowsAtOnce& of);
  bool make_free_row(FreeRow& free) const;
  std::span<FreeRow> free_rows() { return {free_rows_.data(), free_count_}; }
  double missing_of(const FreeRow& free, const Motion& motion, const Eigen::VectorXd& wanted) const;
  void find_free_matrix();
  void solve_free(Motion& motion);
  void solve_free_at_once(std::vector<double>& missing);
  void change_free(std::size_t free, double impulse, std::vector<double>& missing);
  bool is_within(std::size_t free) const;
  void find_touched_response();
  void find_shares(const Sides& rows, Sides& shares);
  void correct_shares(Sides& shares);
  Motion& begin_motion();
  double step_time() const { return moves_ ? span_ : span_ / steps_; }
  bool spins(const Body& body) const { return has_rotors_ && moves_ && body.spin_axis; }
  Eigen::Vector3d turning(const Body& body, const Eigen::Vector3d& rate) const;
  void turn_freely();
  void turn_as_pushed(Eigen::VectorXd& velocities);
  void hold(Motion& motion);
  void push(Motion& motion, const FreeRow& free, double impulse) const;
  Eigen::VectorXd without_soft(Eigen::VectorXd held) const;
  template <typename Numbers>
  double hard_dot(const Eigen::VectorXd& held, const Numbers& other) const;
  const BodyTurns& turns_in(const Eigen::VectorXd& velocities, double time);
  void split_turns_of_rotors(const Eigen::VectorXd& velocities, double time, BodyTurns& turns) const;
  PosedJoint after(const Tie& tie, const Eigen::VectorXd& velocities, double time,
                   std::span<const Eigen::Quaterniond> turns) const;
  JointPoses poses_after(const Tie& tie, const Eigen::VectorXd& velocities, double time,
                         std::span<const Eigen::Quaterniond> turns) const;
  template <typename PosesOf>
  void find_errors(const PosesOf& poses_of, Eigen::VectorXd& errors) const;
  const Eigen::VectorXd& bend_after(const Eigen::VectorXd& velocities);
  void hold_at_end(Motion& motion);
  void tilt_rotors(Motion& motion);
  const Eigen::VectorXd& without_spins(const Eigen::VectorXd& velocities);
  double bent_energy_max(const Eigen::VectorXd& all_velocities);
  bool bend_back(Motion& motion);
  void look_ahead(Motion& motion);
  void make_held_rows_after(const Eigen::VectorXd& velocities);
  static const Eigen::Matrix3d& inertia_of(Body& body);
  const Eigen::VectorXd& momenta_of(const Eigen::VectorXd& velocities);
  void advance();
  void turn_rates_of_rotors(std::span<const Eigen::Quaterniond> tilts, std::size_t next);
  void find_whether_settled(double change);
  void set_motion(const Motion& motion);
  void add_opened(const Eigen::VectorXd& had, double time);
  bool gains_energy();
  void find_ends();
  void begin_impulses();
  void note_impulses();
  void note_efforts();
  void note_impulse(Tie& tie, const Eigen::Vector3d& force, const Eigen::Vector3d& torque) const;
  void note_from_ends(Eigen::VectorXd& momenta);
  void note_by_rows(Eigen::VectorXd& changes);

  std::vector<Tie> ties_;
  std::size_t ties_count_ = 0;  // while they are added
  std::vector<Link> links_;     // their rows come after those of ties
  std::vector<Armature> armatures_;
  bool has_armatures_ = false;
  std::vector<Body> bodies_;
  int steps_ = 1;       // of the tick
  bool moves_ = false;  // from step to step
  double span_ = 0;     // s, over which rows hold: a tick, or a step of those that move
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
  bool is_pushed_ = false;       // by others in this step, and no pass has answered to all of it
  bool awaits_answer_ = false;   // likewise, since the last pass, or since bodies were last moved
  bool is_foreseen_ = true;      // and follow the velocities of each pass
  double gives_way_ = 0;         // the share by which rows do
  bool is_anchored_ = false;     // to something that cannot be pushed
  bool has_rotors_ = false;
  std::vector<FreeDirection> directions_;
  std::size_t directions_count_ = 0;  // those of now are the first ones
  std::vector<FreeRow> free_rows_;
  std::size_t free_count_ = 0;   // likewise
  Eigen::MatrixXd free_matrix_;  // of free rows, by direction: what a unit of impulse of one does to another
  SmallSystem free_system_;
  std::vector<int> factorised_;        // the free rows that it has
  std::vector<Eigen::Index> touched_;  // bodies
  bool is_response_known_ = false;     // in this tick
  Eigen::MatrixXd touched_held_;       // response_, were only joints to hold
  Eigen::MatrixXd touched_free_;       // what a unit of impulse of each direction does to touched bodies
  Eigen::MatrixXd touched_matrix_;     // free_matrix_, of then
  Eigen::MatrixXd response_;
  std::vector<int> holding_;  // the free rows that response_ takes to hold, ascending
  std::vector<bool> gives_;   // by free row: bears() has found that it does not hold
  SmallSystem touched_system_;
  Eigen::VectorXd velocities_;
  Eigen::VectorXd soft_impulses_;
  std::vector<End> ends_;   // of a tree, to what holds it; none where there is a loop
  bool has_begun_ = false;  // a step whose impulses are to be noted
  Eigen::VectorXd began_;   // the velocities at its beginning, forces included
  Eigen::VectorXd pushed_;  // by others, since
  double gained_ = 0;       // J, in this tick
  bool is_settled_ = false;
  double changed_ = 0;         // m or rad, in the way of the step: by the last pass, since others pushed
  bool has_diverged_ = false;  // in this tick: nothing is solved any more
  std::vector<Eigen::VectorXd> ways_;  // the velocities of steps that bodies are still to be moved by ...
  std::size_t ways_count_ = 0;         // ... are the first ones
  Eigen::VectorXd stays_;              // of the last step: those that stayed
  Eigen::VectorXd opened_;             // m, rad: by how much more bodies have moved in steps than by these

  // On how many joints a body hangs that are still there, and the exclusive or of these.
  struct Hanging {
    std::size_t joints = 0;
    std::size_t all = 0;
  };

  // What functions compute with or return, kept for its storage: nothing is left in it for others.
  struct Memory {
    Motion moved;             // by a pass
    BodyTurns turns;          // of turns_in()
    RowsAtOnce rows_at_once;  // of make_directions() and find_touched_response()
    Eigen::VectorXd bend;     // of bend_after()
    Eigen::VectorXd momenta;  // of momenta_of()
    Eigen::VectorXd tilting;  // of without_spins(); or before a tilt
    Eigen::VectorXd whole;    // of all velocities: a way or a change
    Eigen::VectorXd way;
    Eigen::VectorXd held;  // of all held rows
    Eigen::VectorXd rates;
    Eigen::VectorXd impulses;
    Eigen::VectorXd bent;
    Eigen::VectorXd bending;
    Sides whole_sides;
    Sides held_sides;
    Sides correction_sides;
    Sides combined_sides;
    std::vector<Inertia> inertia;
    std::vector<JointRow> rows;
    std::vector<HeldRows::NodeBodies> nodes;
    DisjointSets sets;
    std::vector<Hanging> hanging;
    std::vector<std::size_t> open_ends;
    std::vector<double> free_impulses;
    std::vector<double> missing;  // of free rows
    std::vector<double> changes;  // of their impulses
    std::vector<int> chosen;      // of them
  };
  Memory memory_;
};

}  // namespace tessera::joints
