// The interface of a physics engine: small worlds near their own origin that find contacts, a solver for
// islands over any number of worlds, and the guarantee of the same bits for the same input.
//
// Frames: everything is relative to the centre of the world's sector, in the world's axes; bodies are given
// by their centre frames (body.h). Numbers are doubles, whatever the engine computes with: a float engine
// rounds its input once, and its output is exact.
//
// No bit of the result may depend on the order in which bodies were added: engines order their pairs by
// BodyId, never by history.
//
// Threads: different worlds may be used on different threads at the same time, one world on one thread at a
// time, whose long loops run on the threads that the caller lends it. A solver may run beside other solvers
// as long as no dynamic body or clone is in two tasks.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lpss/base/parallel.h"
#include "lpss/islands/island_end.h"
#include "lpss/joints/island_joint.h"
#include "lpss/joints/joint_loads.h"
#include "lpss/model/body.h"
#include "lpss/model/divergence.h"
#include "lpss/model/joint.h"
#include "lpss/model/settings.h"
#include "lpss/model/shape.h"

namespace tessera {

// The index of a body in one engine world. Slots of removed bodies are reused.
using BodySlot = std::int32_t;
inline constexpr BodySlot kNoSlot = -1;

// The role of a body in this engine world.
enum class Role : std::uint8_t {
  kHome,    // it lives here
  kClone,   // a copy of a body that lives in another sector
  kStatic,  // the part of a static body that this sector needs
};

// Where bodies of different homes are found to touch: in the lower home of two, which has a clone of the
// other one. A fast body, however, may meet any body on its way, so it is told to the sectors above, too, and
// the home of the slower one of two finds their contact; at the same speed, it is the lower home.
enum class Range : std::uint8_t { kUsual, kFast, kFastFromBelow };

// m, the largest SectorWorld::surge(): what forces and drives add in a tick beyond it is not foreseen.
inline constexpr double kSurgeMax = 1;

// The settings of engine worlds and their solvers; the same for all sectors of a world.
struct EngineSettings : WorldSettings {
  // Bullet's own worlds and solver: for the policy clone, as the paper has it, and for whole worlds, the
  // baseline of experiments. Clones touch each other and are solved like bodies, as each needs its supports.
  bool plain_bullet = false;
  bool fine_flight = false;  // free flight (fly()) in double precision, whatever the engine computes with
  // What joints hold together and nothing immovable touches flies, too: it keeps its orbit (end_flight()).
  bool jointed_flight = false;
};

// All contact points of one pair of bodies after detection; `a` < `b`.
struct ContactPair {
  BodyId a;
  BodyId b;
  BodySlot slot_a = 0;
  BodySlot slot_b = 0;
  bool touching = false;       // a point has no gap, or had an impulse in the last solution
  bool bounces = false;        // it may give speed back
  std::uint16_t substeps = 0;  // that it asks for; see Engine::substeps(); 0: no opinion
};

// A point of contact, for events.
struct TouchingPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // on b, m, in the world's axes
  double depth = 0;                                    // m, > 0 if the bodies overlap there
  double impulse = 0;                                  // N s, along the normal, at the last solution
};

// A patch of a pair for events: points that share a normal. Impulses are those of the last solution, on a.
struct ContactDetail {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // on b, pointing to a
  double impulse = 0;                                  // N s, along the normal, of all points
  Eigen::Vector3d friction = Eigen::Vector3d::Zero();  // N s, in the world's axes, across the normal
  std::vector<TouchingPoint> points;                   // relative to the sector's centre
};

// Something in a trigger: a solid part of `visitor` overlaps a part of `trigger` that notices.
struct Overlap {
  BodyId trigger;
  BodyId visitor;

  friend auto operator<=>(const Overlap&, const Overlap&) = default;
};

// The contact points of a pair with all data for warm starting. Only the engine that wrote the bytes can read
// them. Independent of the sector in which the pair was detected.
struct ManifoldState {
  BodyId a;
  BodyId b;
  std::string points;
};

// Which bodies a query looks at.
struct QueryFilter {
  std::uint32_t mask = 0xffffffff;      // their category meets it
  std::span<const BodyId> except = {};  // ascending; none of these

  bool wants(BodyId id, std::uint32_t category) const {
    return (category & mask) != 0 &&
           (except.empty() || !std::binary_search(except.begin(), except.end(), id));
  }
};

struct RayHit {
  BodyId body;
  double fraction = 1;                                // of the way from `from` to `to`
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // world axes, unit length
};

// A body that may leave a box within a tick.
struct BodyOutside {
  BodySlot slot = 0;
  Eigen::AlignedBox3d swept;  // swept_box()
};

// A body that diverged, and was stopped.
struct StoppedBody {
  BodySlot slot = 0;
  DivergenceKind kind = DivergenceKind::kPosition;
};

// What a probe that moves touches first.
struct ProbeHit {
  BodyId body;
  double distance = 0;  // m, of its way
  Eigen::Vector3d normal =
      Eigen::Vector3d::UnitZ();  // on the body, towards the probe; world axes, unit length
};

// A body near a probe.
struct NearBody {
  BodyId body;
  double distance = 0;  // m, between the surfaces; 0 if they overlap
};

// What a frame that turns does to a body in a step.
struct FrameTurn {
  // By the velocities at the beginning; what something holds is to get the mean of that and of what those at
  // the end make of it.
  Eigen::Vector3d acceleration;  // m/s^2, on top of gravity
  Eigen::Vector3d torque;        // N m
  Eigen::Vector3d spin;          // rad/s, of the frame
  // In free flight, in the place of gravity and that: the way (m), and how the velocity changes (m/s).
  Eigen::Vector3d way;
  Eigen::Vector3d change;
};

// One sector's engine world.
class SectorWorld {
 public:
  virtual ~SectorWorld() = default;

  // Adds a body with the shared shape of its properties. `record.home` is ignored: the state is
  // relative to this sector. A body may be in a world only once.
  virtual BodySlot add(const BodyRecord& record, Role role) = 0;

  // Adds the part of a static body that this sector needs: a shape of its own, posed in this sector's frame.
  // Vectors of the surface of static bodies are along the world's axes, here and in add().
  virtual BodySlot add_static(BodyId id, const BodyProperties& properties, const Shape& part,
                              const Pose& pose) = 0;

  // Removes a body and its contacts. Bodies that touched it are not woken.
  virtual void remove(BodySlot slot) = 0;

  virtual BodyState state(BodySlot slot) const = 0;

  // Sets pose, velocities and activity: clones before every step, teleports, kinematic targets. Contacts stay
  // and are updated by the next detection.
  virtual void set_state(BodySlot slot, const BodyState& state) = 0;

  // Parts of state() that are cheap to get.
  virtual Eigen::Vector3d position(BodySlot slot) const = 0;
  virtual Eigen::Vector3d linear_velocity(BodySlot slot) const = 0;
  virtual Activity activity(BodySlot slot) const = 0;

  virtual void set_velocity(BodySlot slot, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) = 0;

  // Changes the surface of a body, given as add() takes it, from the next detection on.
  virtual void set_surface(BodySlot slot, const Surface& surface) = 0;

  // Changes velocities immediately by an impulse (N s) that acts at `lever` (m, from the centre of mass).
  virtual void apply_impulse(BodySlot slot, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever) = 0;

  // A force and torque for the next step only, in addition to gravity. Adds up.
  virtual void add_wrench(BodySlot slot, const Wrench& wrench) = 0;

  // The acceleration (m/s^2) for the next detections, until it is set again. Ignored for bodies without
  // gravity.
  virtual void set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) = 0;

  // Whether joints hold the body, which may be a clone. integrate() does not stop such a body short of an
  // obstacle, which would tear its joints: it relies on the contacts predicted by detect().
  virtual void set_jointed(BodySlot slot, bool jointed) = 0;

  // How much farther (m) than its velocities say a point of the body may get in this tick, by its wrenches
  // and by drives: contacts are found, and boxes reach, so much farther. 0 to kSurgeMax. add_wrench() adds to
  // it; integrate() ends it. Engines that do not look ahead have none.
  virtual double surge(BodySlot) const { return 0; }
  virtual void set_surge(BodySlot, double) {}

  // Of a dynamic body that lives here: it is solved with this mass (kg) and these principal moments (kg m^2)
  // in the place of its own, until they are set again. Engines without frames ignore it.
  virtual void set_mass(BodySlot, double /*mass*/, const std::array<double, 3>& /*moments*/) {}

  // Of a dynamic body that lives here, in a frame that turns: what that makes of its next step. Engines
  // without frames ignore it.
  virtual void set_turning(BodySlot, const FrameTurn&) {}

  // Of a dynamic body that lives here or a clone of one; kUsual until it is set. Policy island.
  virtual void set_range(BodySlot slot, Range range) = 0;

  // Puts the body to sleep (velocities become zero), or wakes it (and resets its time at rest).
  virtual void sleep(BodySlot slot) = 0;
  virtual void wake(BodySlot slot) = 0;

  // Nothing in here moves for now: gives back the memory that only steps need. Changes no bit.
  virtual void rest() = 0;

  // The box that the body's shape can reach within `dt` seconds at its current velocity, including the
  // distance at which contacts are found.
  virtual Eigen::AlignedBox3d swept_box(BodySlot slot, double dt) const = 0;

  // Appends the bodies that live here, may move, and of which swept_box(slot, dt) is not inside `inside`.
  virtual void append_outside(const Eigen::AlignedBox3d& inside, double dt, std::vector<BodyOutside>& outside,
                              const ParallelFor& parallel = {}) const = 0;

  // Whether `box` overlaps the box of any body that lives here (dynamic or kinematic), as of its last update.
  // `hint` is kNoSlot, or what the last call for about the same box left there: it makes the answer quicker,
  // not another one.
  virtual bool reaches_home_body(const Eigen::AlignedBox3d& box, BodySlot& hint) const = 0;

  // First half of a step for the bodies that live here: forces and damping of `dt` seconds, predicted poses,
  // then the contact points of all pairs in which at least one side is awake.
  virtual void detect(double dt, const ParallelFor& parallel = {}) = 0;

  // The pairs with contact points, in ascending order of (a, b), as of the last detect(), import_manifold(),
  // or remove(). Pairs of sleeping bodies keep their points.
  virtual std::span<const ContactPair> contacts() = 0;

  // `pair` is a place in contacts(), which must have been called since the last detect(). The patches of the
  // pair that touch: where a point has no gap, or had an impulse in the last solution.
  virtual std::vector<ContactDetail> touching_patches(std::size_t pair) const = 0;

  virtual ManifoldState export_manifold(std::size_t pair) const = 0;

  // Sets the contact points of a pair to those that it had in another world, before the next detection. The
  // pair is skipped if the two are not near each other. Call on bodies that were just added or moved.
  virtual void import_manifold(const ManifoldState& manifold) = 0;

  // What is in triggers as of the last detection, ascending, of the pairs that this world looks after: those
  // in which a body that can move lives here, in the home of the dynamic one if only one is. Two kinematic
  // bodies are found in the homes of both. `before` is what it said last, with what has come since: pairs in
  // it that rest are not looked at again. Engines without triggers find nothing.
  virtual void find_overlaps(std::span<const Overlap> /*before*/, std::vector<Overlap>& now) { now.clear(); }

  // Whether a body of the world has a trigger.
  virtual bool has_triggers() const { return false; }

  // For a solver elsewhere, between detect() and integrate(): appends the numbers of a dynamic body that
  // lives here, or those of a pair in contacts(). Only engines of the same kind and precision can read them.
  virtual void append_numbers(BodySlot slot, std::string& bytes) const = 0;
  virtual void append_pair_numbers(std::size_t pair, std::string& bytes) const = 0;

  // Takes what that solver made of them from the front of `bytes`. False if that is something else.
  [[nodiscard]] virtual bool take_solved(BodySlot slot, std::string_view& bytes) = 0;
  [[nodiscard]] virtual bool take_solved_pair(std::size_t pair, std::string_view& bytes) = 0;

  // The forces and torques that detect() gathered for the solver.
  virtual Wrench total_wrench(BodySlot slot) const = 0;
  virtual void set_total_wrench(BodySlot slot, const Wrench& wrench) = 0;

  // Free flight of a body that lives here, without contacts and joints: forces become velocity, with the same
  // result as by the solver. Call between detect() and integrate(), instead of passing the body to the
  // solver. This, set_gravity(), end_flight() and what is const are safe for different bodies on different
  // threads.
  virtual void fly(BodySlot slot, double dt) = 0;

  // Whether the body flew in the last step, all the way; see also EngineSettings::jointed_flight. Where
  // gravity differs from place to place, such a body awaits end_flight(), with the acceleration (m/s^2) where
  // it has come to: its velocity takes half of the pull from there, and half from where it was (kick, drift,
  // kick).
  virtual bool flew(BodySlot slot) const = 0;
  virtual void end_flight(BodySlot slot, const Eigen::Vector3d& acceleration, double dt) = 0;

  // Second half of a step: moves the awake bodies that live here with their solved velocities, sweeping the
  // fast ones, clears forces, and counts how long each body has been still. A body that has diverged
  // (divergence_of()), or would come to no place of numbers, stops where it was before the tick. Returns
  // those, in any order.
  virtual std::vector<StoppedBody> integrate(double dt, const ParallelFor& parallel = {}) = 0;

  // Queries look at home and static bodies, never at clones, that `filter` wants.

  // The nearest one that the segment hits.
  virtual std::optional<RayHit> raycast(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                        const QueryFilter& filter) const = 0;

  // The nearest hit of each one, in ascending order of ids.
  virtual std::vector<RayHit> raycast_all(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                          const QueryFilter& filter) const = 0;

  // Those whose shapes are within `reach` (m, >= 0) of a convex `probe` at `pose`, in ascending order of ids.
  virtual std::vector<NearBody> near(const Geometry& probe, const Pose& pose, double reach,
                                     const QueryFilter& filter) const = 0;

  // The first one that a convex `probe` touches that goes from `pose` for `length` m along `direction` (unit
  // length), without turning; of several at the same distance, that of the lowest id. What counts as a touch:
  // lpss/collision/sweep.h.
  virtual std::optional<ProbeHit> sweep(const Geometry& probe, const Pose& pose,
                                        const Eigen::Vector3d& direction, double length,
                                        const QueryFilter& filter) const = 0;
};

// What a task takes from a world, or from elsewhere.
struct WorldBody {
  SectorWorld* world = nullptr;
  BodySlot slot = 0;  // without a world: a place in SolveTask::shipped_bodies
};

struct WorldPair {
  SectorWorld* world = nullptr;
  std::uint32_t pair = 0;  // a place in world->contacts(); without a world: in SolveTask::shipped_pairs
  // Places of the bodies in the task, in the place of clones, too.
  std::uint32_t a = kFixed;
  std::uint32_t b = kFixed;

  static constexpr std::uint32_t kFixed = ~std::uint32_t{0};  // of what cannot be pushed
};

// Islands to solve. Each is in a row: its bodies and joints ascending by ids, its contacts in the canonical
// order (lpss/tick/solve_order.h).
struct SolveTask {
  std::vector<WorldBody> bodies;  // dynamic ones, where they live
  std::vector<WorldPair> contacts;
  std::vector<IslandJoint> joints;
  std::vector<IslandEnd> islands;
  // Of bodies and contacts of others: append_numbers().
  std::vector<std::string_view> shipped_bodies;
  std::vector<std::string_view> shipped_pairs;
};

// What is to be told of a task that was solved.
struct SolvedTask {
  // For take_solved() and take_solved_pair(), of all that was shipped, one after the other; and where each
  // ends.
  std::string bodies;
  std::string pairs;
  std::vector<std::size_t> body_ends;
  std::vector<std::size_t> pair_ends;
  std::vector<BlamedJoint> blamed;      // places are those in the task
  std::vector<JointLoads> joint_loads;  // of the task's joints; none from engines that do not tell

  void clear() { *this = {}; }
};

// Solves contacts and joints for new velocities. A body for which no finite velocity or correction of its
// pose is found stays where it is, with velocities that are not finite: integrate() stops it. What else is in
// a task changes no bit of an island.
class IslandSolver {
 public:
  virtual ~IslandSolver() = default;
  virtual void solve(const SolveTask& task, double dt, SolvedTask& solved,
                     const ParallelFor& parallel = {}) = 0;
};

// Solves islands in step with solvers elsewhere, which have other bodies of the same islands. Their contacts
// are divided into stages, in the order of solving; a sweep goes through all stages once. Before a stage, the
// bodies in it that are others' are told how they move by then (set_motion()). What comes out of a body is
// right if it is one's own, and the same bits as from a solver that has all.
class StagedSolver {
 public:
  virtual ~StagedSolver() = default;

  struct Stages {
    std::span<const std::size_t> ends;  // by stage: the number of the task's contacts up to its end
    int substeps = 0;                   // of the tick, for all islands of the task, which come as one
    bool bounces = false;               // a contact of these islands, here or elsewhere, may give speed back
  };

  // Returns the number of sweeps to come. The task has no joints. It, its worlds and their bodies stay as
  // they are until end().
  virtual int begin(const SolveTask& task, double dt, const Stages& stages) = 0;
  virtual void solve_stage(int sweep, std::size_t stage) = 0;
  virtual void end() = 0;

  // What others must know of a body (its place in the task) before a stage of a sweep in which they have it,
  // and the size of that in bytes. Only solvers of the same precision can read it.
  virtual std::size_t motion_size(int sweep) const = 0;
  virtual void append_motion(int sweep, std::size_t body, std::string& bytes) const = 0;
  virtual void set_motion(int sweep, std::size_t body, std::string_view bytes) = 0;
};

class WholeWorld;  // lpss/engine/whole_world.h

// One precision of one physics engine, with the shapes of one world. Worlds and solvers must not outlive it.
class Engine {
 public:
  virtual ~Engine() = default;

  virtual const EngineSettings& settings() const = 0;

  // Registers a shape under its id, before bodies use it. An id is set once.
  virtual void add_shape(ShapeId id, const Shape& shape) = 0;

  // No body has the shape any more, nor will one be added that has it.
  virtual void forget_shape(ShapeId id) = 0;

  // Safe to call from any thread, once the shapes in use have been added.
  virtual std::unique_ptr<SectorWorld> make_world() = 0;
  virtual std::unique_ptr<IslandSolver> make_solver() = 0;
  // The substeps of an island of so many bodies, of which the contact that asks for most asks for so many.
  virtual int substeps(int asked, std::size_t bodies) const = 0;
  // Null if the engine's contacts cannot be solved in stages.
  virtual std::unique_ptr<StagedSolver> make_staged_solver() = 0;
  // Null for an engine that has none.
  virtual std::unique_ptr<WholeWorld> make_whole_world() = 0;

  // Whether import_manifold() can read it: an engine of this kind and precision has written it.
  virtual bool can_read(const ManifoldState& manifold) const = 0;

  // The contact points of a pair along other axes, to which `turn` turns vectors; without points where the
  // engine cannot.
  virtual ManifoldState turned(const ManifoldState& manifold, const Eigen::Matrix3d& /*turn*/) const {
    return {manifold.a, manifold.b, {}};
  }

  // Sets whether two bodies collide with each other, in every world; joints use it to exclude their bodies.
  // Must not be called during a detection. Takes effect with the next detection.
  virtual void set_apart(BodyId a, BodyId b, bool apart) = 0;
};

}  // namespace tessera
