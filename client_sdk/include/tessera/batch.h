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

// A body by its id or by its name.
using BodyName = std::variant<BodyId, std::string>;

// A body to spawn. `body.properties.shape` is ignored: `shape` is used.
struct NewBody {
  BodyDescription body;
  Shape shape;
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
  // (none: all are where they are described). Its settings are not looked at.
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
  // Moves the body frame to `pose`, with these velocities; values that are not given stay the same. Moves
  // this body only: FAILED_PRECONDITION for one that joints hold, unless `alone`, after which joints pull
  // what they hold together: set_state() moves a robot as a whole.
  CommandList& teleport(const BodyName& body, const TargetPose& pose,
                        const std::optional<Eigen::Vector3d>& linear_velocity = std::nullopt,
                        const std::optional<Eigen::Vector3d>& angular_velocity = std::nullopt,
                        bool alone = false);
  // Places bodies, and what hangs on them: the child of each joint comes to where its parent, which is the
  // world or is placed here, and the joint's position put it. Only what is named moves.
  CommandList& set_state(const std::vector<PlacedBody>& bodies, const std::vector<PlacedJoint>& joints = {});
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

struct JointValues {
  JointId id;
  std::vector<double> positions;  // by axis, rad or m
  std::vector<double> rates;      // rad/s or m/s
};

struct FoundBody {
  BodyId id;
  std::string name;
  BodyProperties properties;
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
  // The first contact, if there is one.
  QueryPlace<std::vector<RayResult>> sweep(const SweepQuery& sweep);
  // Ascending by distance and id.
  QueryPlace<std::vector<Neighbour>> near(const NearQuery& near);
  // Ascending by id; unknown ids are skipped. Without ids and prefix: of all bodies that are not static.
  QueryPlace<std::vector<BodySample>> states(const std::vector<BodyId>& ids, const std::string& prefix = {});
  QueryPlace<std::vector<JointValues>> joint_states(const std::vector<JointId>& ids,
                                                    const std::string& prefix = {});
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
  std::vector<Neighbour> operator[](QueryPlace<std::vector<Neighbour>> place) const;
  std::vector<BodySample> operator[](QueryPlace<std::vector<BodySample>> place) const;
  std::vector<JointValues> operator[](QueryPlace<std::vector<JointValues>> place) const;
  std::string operator[](QueryPlace<std::string> place) const;
  FoundBodies operator[](QueryPlace<FoundBodies> place) const;
  FoundJoints operator[](QueryPlace<FoundJoints> place) const;
  FoundFrames operator[](QueryPlace<FoundFrames> place) const;

 private:
  friend std::string to_json(const Answers& answers);
  std::shared_ptr<const v1::Reply> reply_;
};

}  // namespace tessera
