// The client of a Tessera cluster: load a world, change it, drive it, watch it.
//
//   auto client = tessera::Client::connect("127.0.0.1:7300").value();
//   const auto crate_design = tessera::solid("crate", tessera::box(1, 1, 1), 10, {{0, 0, 0}, {0, 0, 5}});
//   auto crate = client->spawn(crate_design).value();
//   auto frames = client->watch_bodies({.ids = {crate.id}}).value();
//   client->resume().value();
//   for (auto frame = frames->next(); frame.ok(); frame = frames->next()) print(*frame);
//
// Units: m, kg, s, rad, N; positions are sector index and displacement, exact at any distance. Calls block
// until the cluster has answered or their time is up. Errors carry the message of the cluster:
// INVALID_ARGUMENT names the field and the bound, NOT_FOUND a body or joint that is not there, ALREADY_EXISTS
// a name or a world, FAILED_PRECONDITION what is missing (no world, not enough servers), DEADLINE_EXCEEDED an
// answer that did not come in time, UNAVAILABLE a process that is gone.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/time/time.h>

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "lpss/model/tick_counts.h"
#include "lpss/model/world_description.h"
#include "tessera/joints.h"
#include "tessera/stream.h"

namespace tessera {

inline constexpr absl::Duration kCallTimeout = absl::Seconds(10);
inline constexpr absl::Duration kLoadTimeout = absl::Seconds(120);

// A body by its id or by its name.
using BodyName = std::variant<BodyId, std::string>;

// A body to spawn. `body.properties.shape` is not looked at: `shape` is the shape.
struct NewBody {
  BodyDescription body;
  Shape shape;
};

// A joint to add, its frames in body frames. The bodies of `joint.properties` are not looked at: these are
// its.
struct NewJoint {
  JointDescription joint;          // without a name it gets one
  std::optional<BodyName> parent;  // none: the world
  BodyName child;
};

// Shapes of one part, in the body's frame.
Shape box(double x, double y, double z);
Shape sphere(double radius);
Shape capsule(double radius, double length);
Shape cylinder(double radius, double length);

// A dynamic body of even density with the inertia of its shape: of one box, sphere, capsule, cylinder or
// ellipsoid; the inertia of other shapes is that of their bounding sphere.
NewBody solid(std::string name, Shape shape, double mass, const WorldPosition& position);

// Where a body is to be; without an orientation, it stays turned as it is.
struct TargetPose {
  WorldPosition position;
  std::optional<Eigen::Quaterniond> orientation = std::nullopt;
};

struct LoadSummary {
  std::uint64_t bodies = 0;
  std::uint64_t sectors = 0;  // with a body that can move
  std::uint32_t servers = 0;
};

struct Spawned {
  BodyId id;
  Tick tick = 0;  // the first that it takes part in
};

struct AddedJoint {
  JointId id;
  Tick tick = 0;  // the first that it takes part in
};

// Which bodies overlap a probe, or are nearest to it.
struct NearQuery {
  WorldPose pose;
  std::optional<Geometry> probe;  // convex; none: a point
  double reach = 0;               // m from the probe's surface, up to 4 sectors; 0: what overlaps
  std::uint32_t mask = 0;         // collision categories that count; 0: all
  std::uint64_t limit = 0;        // how many at most; 0: 1000
};

struct Neighbour {
  BodyId body;
  std::string name;
  double distance = 0;  // m, between the surfaces; 0 where they overlap
};

struct RayQuery {
  WorldPosition origin;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // of any length but zero
  double length = 100;                                   // m
  std::uint32_t mask = 0;                                // collision categories that count; 0: all
};

struct RayResult {
  BodyId body;
  std::string name;
  double distance = 0;  // m
  WorldPosition position;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

struct HashAt {
  Tick tick = 0;
  std::string hash;  // 32 hexadecimal digits
};

struct FoundBody {
  BodyId id;
  std::string name;
  BodyProperties properties;
};

// Which bodies to find: those that meet all that is set.
struct BodyQuery {
  std::string prefix;       // of the name
  std::vector<BodyId> ids;  // empty: all; those that no body has are passed over
  bool only_static = false;
  bool with_shapes = false;
  std::uint64_t limit = 0;  // how many at most; 0: 1000
};

struct FoundBodies {
  std::vector<FoundBody> bodies;    // ascending by id
  bool truncated = false;           // there are more
  std::map<ShapeId, Shape> shapes;  // where they were asked for: by BodyProperties::shape
};

struct ServerStatus {
  std::uint64_t node = 0;
  std::string stream_address;
  Precision precision = Precision::kFloat32;
  std::uint32_t threads = 0;
  Tick tick = 0;
  std::uint64_t bodies = 0;
  TickCounts counts;  // of its last tick
  std::uint64_t peak_rss_bytes = 0;
  double tick_ms_p50 = 0;
  double tick_ms_p99 = 0;
  double tick_ms_max = 0;
  std::uint64_t exchange_bytes = 0;  // sent to other servers so far
  bool takes_part = false;           // in the world; others wait for one that needs them
  bool suspect = false;              // gives no sign of life: it has ended or stalled
};

struct ClusterStatus {
  std::string state;  // "empty", "loading", "paused", "running", "failed"
  std::string world;
  Tick tick = 0;    // completed by every server
  double time = 0;  // s, simulated
  double real_time_factor = 0;
  std::uint64_t bodies = 0;
  TickCounts counts;             // of the last tick
  TickCounts counts_since_load;  // the most of any tick, or the total: see kTickCounters
  double tick_ms_p50 = 0;        // of the slowest server of each tick, without pacing
  double tick_ms_p99 = 0;
  double tick_ms_max = 0;
  std::uint64_t map_epoch = 0;
  std::vector<ServerStatus> servers;
  std::string failure;  // what ended the world, in state "failed"
  std::uint64_t coordinator_peak_rss_bytes = 0;
  std::optional<WorldSettings> settings;  // of the world, where there is one
  SectorIndex anchor;
};

// One connection to a coordinator. All calls from any thread. Streams may outlive the client.
class Client {
 public:
  // `address` is host:port. UNAVAILABLE, with it, where none answers in `timeout`, or a busy one in ten of
  // it.
  static absl::StatusOr<std::unique_ptr<Client>> connect(const std::string& address,
                                                         absl::Duration timeout = kCallTimeout);
  ~Client();

  // --- worlds ---

  // Gives the world to the servers; it starts paused at tick 0. A world that is there already is an error
  // unless `replace` is set.
  absl::StatusOr<LoadSummary> load(const WorldDescription& world, bool replace = false,
                                   absl::Duration timeout = kLoadTimeout);
  absl::Status unload(absl::Duration timeout = kCallTimeout);

  // --- bodies: each takes effect at the beginning of the tick that it returns, in the order of the calls ---

  absl::StatusOr<Spawned> spawn(const NewBody& body, absl::Duration timeout = kCallTimeout);
  absl::StatusOr<Tick> remove(const BodyName& body, absl::Duration timeout = kCallTimeout);
  absl::StatusOr<Tick> set_velocity(const BodyName& body, const Eigen::Vector3d& linear,
                                    const Eigen::Vector3d& angular, absl::Duration timeout = kCallTimeout);
  // `impulse` in N s and `lever` in m from the centre of mass, along the world's axes.
  absl::StatusOr<Tick> apply_impulse(const BodyName& body, const Eigen::Vector3d& impulse,
                                     const Eigen::Vector3d& lever = Eigen::Vector3d::Zero(),
                                     absl::Duration timeout = kCallTimeout);
  // For one tick.
  absl::StatusOr<Tick> apply_force(const BodyName& body, const Eigen::Vector3d& force,
                                   const Eigen::Vector3d& torque = Eigen::Vector3d::Zero(),
                                   absl::Duration timeout = kCallTimeout);
  // Puts the body frame there, with these velocities; what is not given stays as it is.
  absl::StatusOr<Tick> teleport(const BodyName& body, const TargetPose& pose,
                                const std::optional<Eigen::Vector3d>& linear_velocity = std::nullopt,
                                const std::optional<Eigen::Vector3d>& angular_velocity = std::nullopt,
                                absl::Duration timeout = kCallTimeout);
  // A kinematic body moves so that it arrives there at the end of the tick.
  absl::StatusOr<Tick> set_kinematic_target(const BodyName& body, const TargetPose& pose,
                                            absl::Duration timeout = kCallTimeout);

  // --- joints: likewise ---

  absl::StatusOr<AddedJoint> add_joint(const NewJoint& joint, absl::Duration timeout = kCallTimeout);
  absl::StatusOr<Tick> remove_joint(const JointName& joint, absl::Duration timeout = kCallTimeout);
  // `axis` is 1, or 2 of a universal joint; the other one keeps its drive.
  absl::StatusOr<Tick> set_drive(const JointName& joint, const JointDrive& drive, int axis = 1,
                                 absl::Duration timeout = kCallTimeout);
  // Of both axes of a universal joint.
  absl::StatusOr<Tick> set_drives(const JointName& joint, const JointDrives& drives,
                                  absl::Duration timeout = kCallTimeout);

  // --- time ---

  // Returns when the world stands still, with its tick.
  absl::StatusOr<Tick> pause(absl::Duration timeout = kCallTimeout);
  // `real_time_factor` in simulated seconds per second; 0: as fast as possible.
  absl::StatusOr<Tick> resume(double real_time_factor = 1, absl::Duration timeout = kCallTimeout);
  // Returns when the ticks are done, with the last one. They take as long as they take.
  absl::StatusOr<Tick> step(std::uint64_t ticks = 1, absl::Duration timeout = absl::InfiniteDuration());

  // --- questions ---

  absl::StatusOr<ClusterStatus> status(absl::Duration timeout = kCallTimeout);
  absl::StatusOr<HashAt> hash(absl::Duration timeout = kCallTimeout);
  // The bodies near a probe, in any number of sectors on any number of servers, ascending by distance and id.
  absl::StatusOr<std::vector<Neighbour>> near(const NearQuery& query, absl::Duration timeout = kCallTimeout);

  // The nearest hit, in any number of sectors on any number of servers; nullopt where nothing is hit.
  absl::StatusOr<std::optional<RayResult>> raycast(const RayQuery& ray,
                                                   absl::Duration timeout = kCallTimeout);
  // NOT_FOUND where no body has that name.
  absl::StatusOr<FoundBody> find(const std::string& name, absl::Duration timeout = kCallTimeout);
  // Bodies whose names begin with `prefix`, at most `limit`; 0: 1000.
  absl::StatusOr<FoundBodies> find_bodies(const std::string& prefix, std::uint64_t limit = 0,
                                          absl::Duration timeout = kCallTimeout);
  absl::StatusOr<FoundBodies> find_bodies(const BodyQuery& query, absl::Duration timeout = kCallTimeout);

  // Joints whose names begin with `prefix`, at most `limit`; 0: 1000.
  absl::StatusOr<FoundJoints> find_joints(const std::string& prefix, std::uint64_t limit = 0,
                                          absl::Duration timeout = kCallTimeout);
  // NOT_FOUND where no joint has that name.
  absl::StatusOr<FoundJoint> find_joint(const std::string& name, absl::Duration timeout = kCallTimeout);

  // --- streams: one frame a tick, merged over all servers. FAILED_PRECONDITION where no server is there. ---

  absl::StatusOr<std::unique_ptr<BodyStream>> watch_bodies(const BodyFilter& filter = {},
                                                           absl::Duration timeout = kCallTimeout);
  absl::StatusOr<std::unique_ptr<ContactStream>> watch_contacts(const ContactFilter& filter = {},
                                                                absl::Duration timeout = kCallTimeout);

  absl::StatusOr<std::unique_ptr<SeamStream>> watch_seams(const SeamFilter& filter = {},
                                                          absl::Duration timeout = kCallTimeout);

  // Where `joints` stand, from the states of their bodies at one tick each. INVALID_ARGUMENT for none.
  absl::StatusOr<std::unique_ptr<JointStream>> watch_joints(const std::vector<FoundJoint>& joints,
                                                            std::uint32_t every_ticks = 1,
                                                            absl::Duration timeout = kCallTimeout);

  // Ends the coordinator and its servers.
  absl::Status shutdown(absl::Duration timeout = kCallTimeout);

 private:
  class Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
