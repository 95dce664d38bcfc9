// The client of a Tessera cluster: loads a world, changes it, controls its time, watches it.
//
//   auto client = tessera::Client::connect("127.0.0.1:7300").value();
//   const auto crate_design = tessera::solid("crate", tessera::box(1, 1, 1), 10, {{0, 0, 0}, {0, 0, 5}});
//   auto crate = client->spawn(crate_design).value();
//   auto frames = client->watch_bodies({.ids = {crate.id}}).value();
//   client->resume().value();
//   for (auto frame = frames->next(); frame.ok(); frame = frames->next()) print(*frame);
//
// Units: m, kg, s, rad, N; positions are sector index and displacement, exact at any distance. Calls block
// until the cluster has answered or their timeout has passed. Errors carry the message of the cluster:
// INVALID_ARGUMENT names the field and the bound; NOT_FOUND: no such body or joint; ALREADY_EXISTS: a name is
// in use, or a world is loaded; FAILED_PRECONDITION: no world, or not enough servers; DEADLINE_EXCEEDED: no
// answer in time; UNAVAILABLE: a process is gone.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/time/time.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lpss/model/tick_counts.h"
#include "lpss/model/tick_times.h"
#include "lpss/model/world_description.h"
#include "tessera/batch.h"
#include "tessera/joints.h"
#include "tessera/stream.h"

namespace tessera {

inline constexpr absl::Duration kCallTimeout = absl::Seconds(10);
inline constexpr absl::Duration kLoadTimeout = absl::Seconds(120);

// Shapes of one part, in the body's frame.
Shape box(double x, double y, double z);
Shape sphere(double radius);
Shape capsule(double radius, double length);
Shape cylinder(double radius, double length);

// The shape as a trigger: it notices what overlaps it, and touches nothing (ContactSample::trigger). It adds
// neither mass nor inertia. As a part of the shape of a body, or of all of one.
Shape trigger(Shape shape);

// A dynamic body of uniform density, with the inertia of its shape if that is one box, sphere, capsule,
// cylinder or ellipsoid, and otherwise that of its bounding sphere.
NewBody solid(std::string name, Shape shape, double mass, const WorldPosition& position);

struct SnapshotSummary {
  Tick tick = 0;  // completed
  std::uint64_t bytes = 0;
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

struct HashAt {
  Tick tick = 0;
  std::string hash;           // 32 hexadecimal digits
  std::string programs = {};  // likewise, of the numbers of all programs; empty: there are none
};

// The pose of a frame, from its body at one tick. A position that would leave the range of sectors stays
// relative to the sector of its body.
WorldPose frame_pose(const FoundFrame& frame, const BodySample& body, double sector_size);

// A body that diverged: see Divergence.
struct NamedDivergence : Divergence {
  std::string body_name;   // empty if the body no longer exists
  std::string joint_name;  // likewise
};

// "body 'arm::link' at tick 12: speed above 1e+06 m/s, joint 'arm::elbow'"
std::string to_text(const NamedDivergence& divergence);

// Tiles of ground that a server has at hand.
struct GroundTiles {
  std::uint64_t tiles = 0;
  std::uint64_t bytes = 0;
  std::uint64_t waits = 0;  // tiles that were not there when they were needed, since the server started
  std::uint64_t ticks_waited = 0;  // since the load, in which the server waited for any
};

struct ServerStatus {
  std::uint64_t node = 0;
  std::string stream_address;
  Precision precision = Precision::kFloat32;
  std::uint32_t threads = 0;
  double capacity = 1;              // how much of a world it takes, by comparison with others
  std::vector<std::string> labels;  // key=value, as it was started with
  Tick tick = 0;
  std::uint64_t bodies = 0;
  TickCounts counts;  // of its last tick
  std::uint64_t peak_rss_bytes = 0;
  TickTimes tick_ms;                 // since the load
  std::uint64_t exchange_bytes = 0;  // sent to other servers so far
  std::uint64_t exchange_messages = 0;
  bool takes_part = false;  // in the world; idle servers do not
  bool suspect = false;     // does not respond to the coordinator, or to a server that waits for it
  bool drained = false;     // is to host nothing
  double own_ms = 0;        // of a tick, lately, without waiting for other servers
  bool slow = false;        // the others wait for it most of each tick
  GroundTiles ground;
};

// Commands of one request that the world goes on without, though they were acknowledged: they end the servers
// that carry them out, or need what such commands would have made.
struct LeftOutCommands {
  Tick tick = 0;         // at which they would have taken effect
  std::string commands;  // as JSON, cut off after 1,024 bytes
  std::string reason;
};

// A server that a world has gone on without, since others did not hear it.
struct CutOff {
  std::uint64_t node = 0;
  std::string stream_address;
  std::vector<std::uint64_t> unheard_by;  // servers that waited for it, or that it waited for
  double seconds = 0;                     // for so long, at most
  Tick tick = 0;                          // completed then
};

struct ClusterStatus {
  // "empty", "loading", "paused", "running", "recovering" (from the loss of a server, or waiting for one),
  // "failed"
  std::string state;
  std::string world;
  Tick tick = 0;    // completed by every server
  double time = 0;  // s, simulated
  double real_time_factor = 0;
  std::uint64_t bodies = 0;
  TickCounts counts;             // of the last tick
  TickCounts counts_since_load;  // the most of any tick, or the total: see kTickCounters
  TickTimes tick_ms;             // of the slowest server of each tick, since the load
  std::uint64_t map_epoch = 0;
  std::uint64_t moved_sectors = 0;  // to other servers, to share out their work, since the load
  std::uint64_t moved_bodies = 0;
  std::uint64_t recoveries = 0;       // how often the world went on from a checkpoint, on other servers
  std::uint64_t joined_servers = 0;   // that have begun to take part while the world ran on
  std::uint64_t left_servers = 0;     // likewise, that do not take part any more
  std::uint64_t cut_off_servers = 0;  // that the world has gone on without, since others did not hear them
  std::vector<CutOff> cut_off;        // the last of these
  Tick checkpoint_tick = 0;           // of the latest checkpoint
  std::string store_failure;          // why the store cannot be written at present; empty while it can
  bool waits_for_store = false;       // the world stands still until it can
  std::vector<LeftOutCommands> left_out;  // since the load, or the start of the coordinator: the last 16
  std::vector<ServerStatus> servers;
  std::string failure;  // why the world ended, in state "failed"
  std::uint64_t coordinator_peak_rss_bytes = 0;
  std::optional<WorldSettings> settings;  // of the world, if there is one
  SectorIndex anchor;
  // The first kDivergencesKept since the load, ascending by (tick, body, kind); `counts_since_load` has all.
  std::vector<NamedDivergence> divergences;
};

// How a world is divided anew among its servers.
struct Balance {
  struct Share {
    std::uint64_t node = 0;
    double tick_ms = 0;       // of own work, mean of the last ticks
    double tick_ms_then = 0;  // after the move, by the measured cost of what moves
  };
  Tick tick = 0;              // of the measurement
  std::vector<Share> shares;  // of the servers of the world
  std::uint64_t moved_sectors = 0;
  std::uint64_t moved_bodies = 0;
  bool moves = false;  // with the next tick; false for a dry run, and where nothing is gained
};

// One connection to a coordinator. Safe to use from any thread. Streams may outlive the client.
class Client {
 public:
  // `address` is host:port, or those of all coordinators of the cluster, separated by commas: calls then go
  // to the one that leads, also where that changes. INVALID_ARGUMENT for an address without a port;
  // UNAVAILABLE, with the address, if there is no answer within `timeout`, or from a busy coordinator within
  // ten times that. A cluster with keys wants `keys`, a folder that `tessera keys create` made: NOT_FOUND,
  // with the file, if it lacks one. Calls that its role may not make end with PERMISSION_DENIED.
  static absl::StatusOr<std::unique_ptr<Client>> connect(const std::string& address,
                                                         absl::Duration timeout = kCallTimeout,
                                                         const std::filesystem::path& keys = {});
  ~Client();

  // --- worlds ---

  // Loads the world on the servers; it starts paused at tick 0. ALREADY_EXISTS if a world is loaded, unless
  // `replace` is set.
  absl::StatusOr<LoadSummary> load(const WorldDescription& world, bool replace = false,
                                   absl::Duration timeout = kLoadTimeout);
  absl::Status unload(absl::Duration timeout = kCallTimeout);

  // Writes all of the world between two ticks, whether it runs or not, to a file; one of that name is
  // replaced once the new one is whole. UNAVAILABLE if it cannot be written.
  absl::StatusOr<SnapshotSummary> snapshot(const std::filesystem::path& file,
                                           absl::Duration timeout = kLoadTimeout);

  // Loads the world of such a file: paused at its tick, it goes on with the bits that it would have had, on
  // any number of servers. DATA_LOSS for a file that is damaged, FAILED_PRECONDITION for one of another
  // version, both before anything is changed; otherwise as load().
  absl::StatusOr<LoadSummary> restore(const std::filesystem::path& file, bool replace = false,
                                      absl::Duration timeout = kLoadTimeout);

  // --- commands, ticks and queries ---

  // Does all of the batch in its order; with queries, one message there and back. Commands are accepted, and
  // stored, when it returns: they take effect at the tick that the answers name. A request whose connection
  // is lost is made again, to whoever leads then, and carried out once.
  absl::StatusOr<Answers> run(const Batch& batch, absl::Duration timeout = absl::InfiniteDuration());

  // Likewise, without waiting for the answers: thousands a second. They take effect in the order in which
  // they are sent. Waits only where 1024 have no answer. `done` gets the answers, on a thread of the client,
  // and must not wait there.
  void send(const Batch& batch, std::function<void(absl::StatusOr<Answers>)> done);

  absl::StatusOr<Applied> apply(const CommandList& commands, absl::Duration timeout = kCallTimeout);
  // Sees what this client has done before, unless the world is paused.
  absl::StatusOr<Answers> ask(const QueryList& queries, absl::Duration timeout = kCallTimeout);

  // --- one command: it takes effect at the beginning of the tick that it returns. See CommandList ---

  absl::StatusOr<Spawned> spawn(const NewBody& body, absl::Duration timeout = kCallTimeout);
  absl::StatusOr<Tick> remove(const BodyName& body, absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().remove(body), timeout);
  }
  absl::StatusOr<Tick> set_velocity(const BodyName& body, const Eigen::Vector3d& linear,
                                    const Eigen::Vector3d& angular, absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().set_velocity(body, linear, angular), timeout);
  }
  absl::StatusOr<Tick> apply_impulse(const BodyName& body, const Eigen::Vector3d& impulse,
                                     const Eigen::Vector3d& lever = Eigen::Vector3d::Zero(),
                                     absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().apply_impulse(body, impulse, lever), timeout);
  }
  absl::StatusOr<Tick> apply_force(const BodyName& body, const Eigen::Vector3d& force,
                                   const Eigen::Vector3d& torque = Eigen::Vector3d::Zero(),
                                   absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().apply_force(body, force, torque), timeout);
  }
  absl::StatusOr<Tick> teleport(const BodyName& body, const TargetPose& pose,
                                const std::optional<Eigen::Vector3d>& linear_velocity = std::nullopt,
                                const std::optional<Eigen::Vector3d>& angular_velocity = std::nullopt,
                                absl::Duration timeout = kCallTimeout, bool alone = false) {
    return tick_of(CommandList().teleport(body, pose, linear_velocity, angular_velocity, alone), timeout);
  }
  absl::StatusOr<Tick> set_kinematic_target(const BodyName& body, const TargetPose& pose,
                                            absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().set_kinematic_target(body, pose), timeout);
  }
  absl::StatusOr<Tick> set_surface_motion(const BodyName& body, const Eigen::Vector3d& velocity,
                                          const Eigen::Vector3d& running = Eigen::Vector3d::Zero(),
                                          absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().set_surface_motion(body, velocity, running), timeout);
  }
  absl::StatusOr<AddedJoint> add_joint(const NewJoint& joint, absl::Duration timeout = kCallTimeout);
  absl::StatusOr<Tick> remove_joint(const JointName& joint, absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().remove_joint(joint), timeout);
  }
  absl::StatusOr<Tick> set_drive(const JointName& joint, const JointDrive& drive, int axis = 1,
                                 absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().set_drive(joint, drive, axis), timeout);
  }
  absl::StatusOr<Tick> set_drives(const JointName& joint, const JointDrives& drives,
                                  absl::Duration timeout = kCallTimeout) {
    return tick_of(CommandList().set_drives(joint, drives), timeout);
  }

  // --- time ---

  // Returns the tick at which the world has paused.
  absl::StatusOr<Tick> pause(absl::Duration timeout = kCallTimeout);
  // `real_time_factor` in simulated seconds per second; 0: as fast as possible.
  absl::StatusOr<Tick> resume(double real_time_factor = 1, absl::Duration timeout = kCallTimeout);
  // Returns the last tick once all are done, however long they take.
  absl::StatusOr<Tick> step(std::uint64_t ticks = 1, absl::Duration timeout = absl::InfiniteDuration());

  // --- one query: see QueryList ---

  absl::StatusOr<ClusterStatus> status(absl::Duration timeout = kCallTimeout);
  absl::StatusOr<HashAt> hash(absl::Duration timeout = kCallTimeout);
  // The bodies near a probe, in any number of sectors on any number of servers, ascending by distance and id.
  absl::StatusOr<std::vector<Neighbour>> near(const NearQuery& query, absl::Duration timeout = kCallTimeout);

  // The nearest hit, in any number of sectors on any number of servers; nullopt if nothing is hit.
  absl::StatusOr<std::optional<RayResult>> raycast(const RayQuery& ray,
                                                   absl::Duration timeout = kCallTimeout);
  // NOT_FOUND if no body has that name.
  absl::StatusOr<FoundBody> find(const std::string& name, absl::Duration timeout = kCallTimeout);
  // Bodies whose names begin with `prefix`, at most `limit`; 0: 1000.
  absl::StatusOr<FoundBodies> find_bodies(const std::string& prefix, std::uint64_t limit = 0,
                                          absl::Duration timeout = kCallTimeout);
  absl::StatusOr<FoundBodies> find_bodies(const BodyQuery& query, absl::Duration timeout = kCallTimeout);

  // Joints whose names begin with `prefix`, at most `limit`; 0: 1000.
  absl::StatusOr<FoundJoints> find_joints(const std::string& prefix, std::uint64_t limit = 0,
                                          absl::Duration timeout = kCallTimeout);
  // NOT_FOUND if no joint has that name.
  absl::StatusOr<FoundJoint> find_joint(const std::string& name, absl::Duration timeout = kCallTimeout);

  // Frames whose names begin with `prefix`, at most `limit`; 0: 1000.
  absl::StatusOr<FoundFrames> find_frames(const std::string& prefix, std::uint64_t limit = 0,
                                          absl::Duration timeout = kCallTimeout);
  // NOT_FOUND if no frame has that name.
  absl::StatusOr<FoundFrame> find_frame(const std::string& name, absl::Duration timeout = kCallTimeout);

  // --- streams: one frame per tick, merged over all servers. A world that recovers is waited for.
  // FAILED_PRECONDITION without a loaded world, or where no server of it has come back in time ---

  absl::StatusOr<std::unique_ptr<BodyStream>> watch_bodies(const BodyFilter& filter = {},
                                                           absl::Duration timeout = kCallTimeout);
  absl::StatusOr<std::unique_ptr<ContactStream>> watch_contacts(const ContactFilter& filter = {},
                                                                absl::Duration timeout = kCallTimeout);

  absl::StatusOr<std::unique_ptr<SeamStream>> watch_seams(const SeamFilter& filter = {},
                                                          absl::Duration timeout = kCallTimeout);

  // Bodies that diverge. The first frame is empty: its tick is the one from which on the stream is complete.
  absl::StatusOr<std::unique_ptr<DivergenceStream>> watch_divergences(absl::Duration timeout = kCallTimeout);

  // What programs publish. That a body is gone is told by watch_bodies() alone.
  absl::StatusOr<std::unique_ptr<ProgramStream>> watch_programs(const ProgramFilter& filter = {},
                                                                absl::Duration timeout = kCallTimeout);

  // The positions of `joints`, from the states of their bodies at each tick. INVALID_ARGUMENT if there are
  // none.
  absl::StatusOr<std::unique_ptr<JointStream>> watch_joints(const std::vector<FoundJoint>& joints,
                                                            std::uint32_t every_ticks = 1,
                                                            absl::Duration timeout = kCallTimeout);

  // Moves all that a server hosts to others, which it waits for, so that it can be ended without a loss; the
  // tick at which they took over. NOT_FOUND for no server of the cluster, FAILED_PRECONDITION where no other
  // one could take over.
  absl::StatusOr<Tick> drain(std::uint64_t node, absl::Duration timeout = kLoadTimeout);

  // Divides the world anew among its servers, by what they have to do; the state stays the same bits. A call
  // moves a bounded number of sectors, at the beginning of the next tick. `dry_run`: only says what it would
  // do. `policy`: "curve", "k-means", "hulls", "graph" or "grid"; empty: the coordinator's.
  // FAILED_PRECONDITION without a world, INVALID_ARGUMENT for another policy.
  absl::StatusOr<Balance> balance(bool dry_run = false, const std::string& policy = {},
                                  absl::Duration timeout = kCallTimeout);

  // Ends the coordinator and its servers.
  absl::Status shutdown(absl::Duration timeout = kCallTimeout);

 private:
  class Impl;
  absl::StatusOr<Tick> tick_of(const CommandList& command, absl::Duration timeout) {
    const absl::StatusOr<Applied> applied = apply(command, timeout);
    if (!applied.ok()) return applied.status();
    return applied->tick;
  }
  static v1::Request request_of(const Batch& batch);
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
