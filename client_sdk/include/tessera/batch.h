// What a client wants of a world in one message: commands, ticks, queries.
//
//   tessera::Batch batch;
//   batch.commands.set_velocity("cart", {1, 0, 0}).apply_impulse("crate", {0, 0, 5});
//   const auto ground = batch.queries.ray({.origin = above, .direction = {0, 0, -1}});
//   const tessera::Answers answers = client->run(batch).value();
//   for (const tessera::RayResult& hit : answers[ground]) print(hit.body, hit.distance);
//
// Units: m, kg, s, rad, N; vectors along the world's axes.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "lpss/model/world_description.h"
#include "tessera/joints.h"
#include "tessera/stream.h"

namespace tessera {

namespace v1 {
class Reply;
class Request;
}  // namespace v1

struct Batch;
class Answers;
absl::StatusOr<Batch> batch_from_json(std::string_view json);
std::string to_json(const Answers& answers);

// Drives of many joints, which all have one mode. Of each array, as JointDrive has them: one number for each
// joint, or one for all, or none, which is 0.
struct DriveColumns {
  DriveMode mode = DriveMode::kPosition;
  std::span<const double> targets;
  std::span<const double> stiffness;
  std::span<const double> damping;
  std::span<const double> velocities;
  std::span<const double> efforts;
};

// A body by its id or by its name.
using BodyName = std::variant<BodyId, std::string>;

// A body to spawn. `body.properties.shape` is ignored: `shape` is used.
struct NewBody {
  BodyDescription body;
  Shape shape;
  ProgramModules modules = {};  // of its programs: the world has them from then on
};

// A joint to add, with its frames in body frames. The bodies of `joint.properties` are ignored: `parent` and
// `child` are used.
struct NewJoint {
  JointDescription joint;          // a missing name is generated
  std::optional<BodyName> parent;  // none: the world
  BodyName child;
};

// The target of a body; without an orientation, it keeps its own.
struct TargetPose {
  WorldPosition position;
  std::optional<Eigen::Quaterniond> orientation = std::nullopt;
};

// A body that CommandList::set_state() places.
struct PlacedBody {
  BodyName body;
  WorldPose pose;                                             // of the body frame
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();  // of the centre of mass
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
};

// A joint whose child CommandList::set_state() places. Positions and rates by axis, rad or m.
struct PlacedJoint {
  JointName joint;
  std::vector<double> positions;                                 // missing ones are 0
  std::vector<double> rates;                                     // likewise
  std::optional<Eigen::Quaterniond> orientation = std::nullopt;  // of a ball joint
};

// What may change of a body while the world runs; the motion between dynamic and kinematic.
struct ChangedProperties {
  std::optional<Motion> motion = std::nullopt;
  std::optional<double> mass = std::nullopt;
  std::optional<Eigen::Vector3d> inertia = std::nullopt;  // principal moments, kg m^2
  std::optional<double> friction = std::nullopt;
  std::optional<double> restitution = std::nullopt;
  std::optional<double> linear_damping = std::nullopt;
  std::optional<double> angular_damping = std::nullopt;
  std::optional<std::uint32_t> category = std::nullopt;
  std::optional<std::uint32_t> mask = std::nullopt;
  std::optional<bool> gravity = std::nullopt;
  std::optional<std::string> user_data = std::nullopt;  // bytes, at most 1024
  std::optional<std::string> owner = std::nullopt;      // see Batch::owner; empty: nobody in particular
};

// An input, a parameter or a value of a program.
struct NamedNumber {
  std::string name;
  double value = 0;
};

// Commands that take effect together, at the beginning of one tick, in their order; or none of them does.
class CommandList {
 public:
  CommandList();
  ~CommandList();
  CommandList(CommandList&&) noexcept;
  CommandList& operator=(CommandList&&) noexcept;

  std::size_t size() const;

  CommandList& spawn(const NewBody& body);
  // The bodies, joints and frames of `model`, with `prefix` before their names, and with its origin at `pose`
  // (none: all are where they are described). Of its settings, only the modules count.
  CommandList& spawn(const WorldDescription& model, const std::string& prefix = {},
                     const std::optional<WorldPose>& pose = std::nullopt);
  // With the joints and frames of the body.
  CommandList& remove(const BodyName& body);
  // All bodies whose names begin with `prefix`: at least one.
  CommandList& remove_all(const std::string& prefix);

  // A kinematic body goes on with these velocities (m/s, rad/s) until another command changes them.
  CommandList& set_velocity(const BodyName& body, const Eigen::Vector3d& linear,
                            const Eigen::Vector3d& angular = Eigen::Vector3d::Zero());
  // `impulse` in N s and `lever` in m from the centre of mass.
  CommandList& apply_impulse(const BodyName& body, const Eigen::Vector3d& impulse,
                             const Eigen::Vector3d& lever = Eigen::Vector3d::Zero());
  // For the duration of one tick.
  CommandList& apply_force(const BodyName& body, const Eigen::Vector3d& force,
                           const Eigen::Vector3d& torque = Eigen::Vector3d::Zero());
  // In every tick from now on, in the place of the force that the body had; none: it has none any more.
  CommandList& set_force(const BodyName& body, const std::optional<LastingForce>& force);
  // Sets inputs and parameters of a program of a body by their names (docs/programs.md); `program` is its
  // place on the body. INVALID_ARGUMENT for a body without it, an unknown name and a value out of bounds.
  CommandList& tell_program(const BodyName& body, const std::vector<NamedNumber>& numbers,
                            std::uint32_t program = 0);
  // Moves the body frame to `pose`, with these velocities; values that are not given stay the same. Moves
  // this body only: FAILED_PRECONDITION for one that joints hold, unless `alone`, after which joints pull
  // what they hold together: set_state() moves a robot as a whole.
  CommandList& teleport(const BodyName& body, const TargetPose& pose,
                        const std::optional<Eigen::Vector3d>& linear_velocity = std::nullopt,
                        const std::optional<Eigen::Vector3d>& angular_velocity = std::nullopt,
                        bool alone = false);
  // Places bodies, and what hangs on them: the child of each joint comes to where its parent, which is the
  // world or is placed here, and the joint's position put it. Only what is named moves. With
  // `keeps_contacts`, contacts of bodies that stay in their sectors keep their impulses where they still
  // touch.
  CommandList& set_state(const std::vector<PlacedBody>& bodies, const std::vector<PlacedJoint>& joints = {},
                         bool keeps_contacts = false);
  // A kinematic body moves so that it reaches `pose` at the end of the tick, at the velocity that this takes,
  // and then stays there until the next target or velocity.
  CommandList& set_kinematic_target(const BodyName& body, const TargetPose& pose);
  // How the surface of a body of any kind moves from now on, in its body frame and m/s: Surface in
  // lpss/model/surface.h. Starts and stops conveyor belts (`velocity`) and tracks (`running`).
  CommandList& set_surface_motion(const BodyName& body, const Eigen::Vector3d& velocity,
                                  const Eigen::Vector3d& running = Eigen::Vector3d::Zero());

  // What is not given stays as it is: see ChangedProperties.
  CommandList& set_properties(const BodyName& body, const ChangedProperties& properties);
  // Pushes every dynamic body whose centre of mass is nearer than `radius` (m, up to 4 sectors), away from
  // `centre`: with `impulse` (N s; less than 0 pulls) there, and evenly less down to none at the radius.
  // `mask`: collision categories that count; 0: all.
  CommandList& apply_radial_impulse(const WorldPosition& centre, double radius, double impulse,
                                    std::uint32_t mask = 0);

  CommandList& add_joint(const NewJoint& joint);
  CommandList& remove_joint(const JointName& joint);
  // `axis` is 1, or 2 of a universal joint; the other one keeps its drive.
  CommandList& set_drive(const JointName& joint, const JointDrive& drive, int axis = 1);
  // Sets the drives of both axes of a universal joint.
  CommandList& set_drives(const JointName& joint, const JointDrives& drives);
  // Sets one axis of each of many joints: one command, in a fraction of the time.
  CommandList& set_drives(std::span<const JointId> joints, const DriveColumns& drives, int axis = 1);

 private:
  friend class Client;
  friend absl::StatusOr<Batch> batch_from_json(std::string_view json);
  std::unique_ptr<v1::Request> request_;  // with these commands alone
};

// What a command made.
struct Created {
  std::size_t command = 0;  // its place in the list
  BodyId first_body;        // ids of its bodies follow each other; 0: none
  std::size_t bodies = 0;
  JointId first_joint;  // likewise
  std::size_t joints = 0;
};

struct Applied {
  Tick tick = 0;                 // at whose beginning the commands take effect
  std::vector<Created> created;  // by commands that made something
};

struct RayQuery {
  WorldPosition origin;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // of any length but zero
  double length = 100;                                   // m
  std::uint32_t mask = 0;                                // collision categories that count; 0: all
  std::vector<BodyName> except = {};                     // passes through these
};

struct RayResult {
  BodyId body;
  std::string name;
  double distance = 0;  // m
  WorldPosition position;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

// Many rays, each up to its first hit: faster than one by one.
struct RaysQuery {
  struct Ray {
    WorldPosition origin;
    Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // of any length but zero
    double length = 100;                                   // m
    BodyId except = {};                                    // passes through this one, too; 0: none
  };
  std::vector<Ray> rays;
  std::uint32_t mask = 0;             // collision categories that count; 0: all
  std::vector<BodyName> except = {};  // all rays pass through these
};

struct FirstHit {
  BodyId body;
  double distance = 0;  // m
  WorldPosition position;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

// A convex probe that moves along a line without turning.
struct SweepQuery {
  WorldPose pose;
  Geometry probe = Sphere{0.5};
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
  double length = 100;
  std::uint32_t mask = 0;
  std::vector<BodyName> except = {};
};

// Finds the bodies that overlap a probe, or are nearest to it.
struct NearQuery {
  WorldPose pose;
  std::optional<Geometry> probe;  // convex; none: a point
  double reach = 0;               // m from the probe's surface, up to 4 sectors; 0: overlaps only
  std::uint32_t mask = 0;         // collision categories that count; 0: all
  std::uint64_t limit = 0;        // how many at most; 0: 1000
  std::vector<BodyName> except = {};
};

struct Neighbour {
  BodyId body;
  std::string name;
  double distance = 0;  // m, between the surfaces; 0 if they overlap
};

// The patches in which bodies touch others, as the last tick left them.
struct ContactsQuery {
  std::vector<BodyName> bodies;
  std::string prefix = {};  // also of bodies whose names begin so; empty: none
  std::uint64_t limit = 0;  // patches; 0: 1000
};

struct FoundContacts {
  std::vector<ContactSample> contacts;  // ascending by (a, b); patches of a pair in one order; all kPersist
  bool truncated = false;               // there are more
};

struct DistanceQuery {
  BodyName a;
  BodyName b;
  double reach = 0;  // m, up to 4 sectors: up to where the distance is looked for
};

// Of two bodies that are not beyond the reach.
struct BodyDistance {
  // m; < 0 where convex parts of them overlap: how far one would have to move along the normal, at most.
  double distance = 0;
  WorldPosition on_a;  // on the surfaces
  WorldPosition on_b;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of unit length, from b to a
};

// The joints with these ids, and those whose names begin with `prefix`; without both, all.
struct JointStatesQuery {
  std::vector<JointId> ids = {};
  std::string prefix = {};
  bool efforts = false;    // whether the result has them
  bool reactions = false;  // likewise
};

struct JointValues {
  JointId id;
  std::vector<double> positions;  // by axis, rad or m
  std::vector<double> rates;      // rad/s or m/s
  // N m or N: what drive, spring, damping, friction and limit gave, together; positive where they push to
  // larger positions. The mean over the last tick in which the joint was awake.
  std::vector<double> efforts = {};
  // With which the joint acts on its child, efforts included, along the axes of the joint frame on the child;
  // the torque about its origin. Mean likewise. The parent bears the opposite.
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   // N
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // N m
};

// A point of a body.
struct BodyPoint {
  BodyName body;
  Eigen::Vector3d local = Eigen::Vector3d::Zero();  // m, in the body frame
};

// The dynamics of an assembly, M(q) a + bias(q, v) = efforts: message DynamicsQuery in proto/query.proto says
// of what, and names its degrees of freedom.
struct DynamicsQuery {
  std::optional<BodyName> body = {};       // a dynamic one of the assembly; or
  std::optional<JointName> joint = {};     // one of its joints
  std::vector<double> accelerations = {};  // for which efforts are asked: by degree of freedom, or none
  std::vector<BodyPoint> points = {};      // whose Jacobians are asked for
  bool mass_matrix = false;                // whether the result has it
};

struct Dynamics {
  BodyId base;                  // the body that floats; 0: it hangs on something
  std::vector<JointId> joints;  // from the base on
  std::vector<int> freedoms;    // of each joint, 0 to 3
  Eigen::VectorXd velocities;   // by degree of freedom
  Eigen::VectorXd bias;         // efforts without which nothing accelerates: gravity, Coriolis
  Eigen::VectorXd efforts;      // for the accelerations, if there were any
  Eigen::MatrixXd mass_matrix;
  std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> jacobians;  // by point: its velocity, then angular
};

struct ProgramsQuery {
  std::vector<BodyId> ids = {};
  std::string prefix = {};  // of the names of bodies; empty together with no ids: all that have programs
  std::uint64_t limit = 0;  // programs; 0: 1000
};

struct FoundProgram {
  BodyId body;
  std::string body_name;
  std::uint32_t program = 0;  // its place on the body
  std::string kind;
  std::vector<NamedNumber> parameters;
  std::vector<NamedNumber> inputs;
  std::vector<NamedNumber> values;  // its state, as its last run left it
  std::string fault;                // why it was stopped; empty: it runs
  std::string name;                 // of the program; may be empty
};

struct FoundPrograms {
  std::vector<FoundProgram> programs;  // ascending by (body, program)
  bool truncated = false;              // there are more
};

struct FoundBody {
  BodyId id;
  std::string name;
  BodyProperties properties;
  std::string user_data;  // bytes
  std::string owner;
};

// Finds the bodies that meet all conditions that are set.
struct BodyQuery {
  std::string prefix;       // of the name
  std::vector<BodyId> ids;  // empty: all; unknown ids are skipped
  bool only_static = false;
  bool with_shapes = false;
  std::uint64_t limit = 0;  // how many at most; 0: 1000
};

struct FoundBodies {
  std::vector<FoundBody> bodies;    // ascending by id
  bool truncated = false;           // there are more
  std::map<ShapeId, Shape> shapes;  // if requested: by BodyProperties::shape
};

// A frame that is fixed to a body: frame_pose() has its pose.
struct FoundFrame {
  std::string name;
  BodyId body;
  std::string body_name;
  Pose pose;  // in the body frame
};

struct FoundFrames {
  std::vector<FoundFrame> frames;  // ascending by name
  bool truncated = false;          // there are more
};

// The place of a query in its list, by which Answers has its result.
template <typename Result>
struct QueryPlace {
  int place = 0;
};

// Queries that are answered at the end of one tick, over any number of sectors and servers. What is found by
// name is told as of all commands that have been accepted.
class QueryList {
 public:
  QueryList();
  ~QueryList();
  QueryList(QueryList&&) noexcept;
  QueryList& operator=(QueryList&&) noexcept;

  std::size_t size() const;

  // The first hit, if there is one.
  QueryPlace<std::vector<RayResult>> ray(const RayQuery& ray);
  // The nearest hit of each body, ascending by distance and id.
  QueryPlace<std::vector<RayResult>> ray_all(const RayQuery& ray);
  // Whether anything is hit.
  QueryPlace<bool> ray_any(const RayQuery& ray);
  // The first hit of each ray, in their order; nothing where there is none.
  QueryPlace<std::vector<std::optional<FirstHit>>> rays(const RaysQuery& rays);
  // The first contact, if there is one.
  QueryPlace<std::vector<RayResult>> sweep(const SweepQuery& sweep);
  // Ascending by distance and id.
  QueryPlace<std::vector<Neighbour>> near(const NearQuery& near);
  // Ascending by id; unknown ids are skipped. Without ids and prefix: of all bodies that are not static.
  QueryPlace<std::vector<BodySample>> states(const std::vector<BodyId>& ids, const std::string& prefix = {});
  // Likewise. Without ids and prefix: of all joints.
  QueryPlace<std::vector<JointValues>> joint_states(const JointStatesQuery& query = {});
  QueryPlace<FoundContacts> contacts(const ContactsQuery& query);
  // Nothing where they are farther apart than the reach, or one of them is not there.
  QueryPlace<std::optional<BodyDistance>> distance(const DistanceQuery& query);
  QueryPlace<Dynamics> dynamics(const DynamicsQuery& query);
  QueryPlace<FoundPrograms> programs(const ProgramsQuery& query = {});
  // Of the state of the world: 32 hexadecimal digits.
  QueryPlace<std::string> hash();
  QueryPlace<FoundBodies> find_bodies(const BodyQuery& query);
  // Whose names begin with `prefix`; `limit` 0: 1000.
  QueryPlace<FoundJoints> find_joints(const std::string& prefix, std::uint64_t limit = 0);
  QueryPlace<FoundFrames> find_frames(const std::string& prefix, std::uint64_t limit = 0);

 private:
  friend class Client;
  friend absl::StatusOr<Batch> batch_from_json(std::string_view json);
  std::unique_ptr<v1::Request> request_;  // with these queries alone
};

// In this order. All of it is checked first: where anything is wrong, nothing is done, and the error names
// the element.
struct Batch {
  CommandList commands;
  std::uint64_t ticks = 0;  // of a world that is paused
  QueryList queries;        // answered after these ticks; without any, at once, but
  Tick after = 0;           // not before this tick of earlier commands is over, as long as the world runs
  // If set, commands are limited to bodies of this owner, and what they spawn is the owner's. A client with a
  // key of role "own" is always limited so, to its own name.
  std::string owner = {};
};

class Answers {
 public:
  // `reply` has results of the kinds that were asked for.
  explicit Answers(std::shared_ptr<const v1::Reply> reply) : reply_(std::move(reply)) {}

  Tick tick() const;        // completed: of the results, or the last of the ticks
  Applied applied() const;  // of the commands; the tick is 0 where there were neither these nor ticks

  // The results of queries of the same batch.
  std::vector<RayResult> operator[](QueryPlace<std::vector<RayResult>> place) const;
  bool operator[](QueryPlace<bool> place) const;
  std::vector<std::optional<FirstHit>> operator[](
      QueryPlace<std::vector<std::optional<FirstHit>>> place) const;
  std::vector<Neighbour> operator[](QueryPlace<std::vector<Neighbour>> place) const;
  std::vector<BodySample> operator[](QueryPlace<std::vector<BodySample>> place) const;
  std::vector<JointValues> operator[](QueryPlace<std::vector<JointValues>> place) const;
  FoundContacts operator[](QueryPlace<FoundContacts> place) const;
  std::optional<BodyDistance> operator[](QueryPlace<std::optional<BodyDistance>> place) const;
  Dynamics operator[](QueryPlace<Dynamics> place) const;
  FoundPrograms operator[](QueryPlace<FoundPrograms> place) const;
  std::string operator[](QueryPlace<std::string> place) const;
  std::string program_hash(QueryPlace<std::string> place) const;  // of programs; empty: there are none
  FoundBodies operator[](QueryPlace<FoundBodies> place) const;
  FoundJoints operator[](QueryPlace<FoundJoints> place) const;
  FoundFrames operator[](QueryPlace<FoundFrames> place) const;

 private:
  friend std::string to_json(const Answers& answers);
  std::shared_ptr<const v1::Reply> reply_;
};

}  // namespace tessera
