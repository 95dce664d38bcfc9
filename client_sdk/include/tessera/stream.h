// Streams of a cluster: states of bodies, contacts, and clones and islands at seams, tick by tick.
//
// Every server streams the contents of its sectors; the parts of one tick are merged into one frame. A body
// that changes servers is in each frame exactly once.
#pragma once

#include <absl/status/statusor.h>
#include <absl/time/time.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "lpss/model/contact_phase.h"
#include "lpss/model/divergence.h"

namespace tessera {

using Tick = std::uint64_t;

// A box along the world's axes.
struct WatchedRegion {
  WorldPosition centre;
  Eigen::Vector3d half_size = Eigen::Vector3d::Constant(100);  // m
};

// Selects bodies: those that match all of it.
struct BodyFilter {
  std::optional<WatchedRegion> region;  // none: everywhere
  std::vector<BodyId> ids;              // empty: all that are not static
  // The region goes with this body: `half_size` about where it is at each tick, whatever its centre is. The
  // body itself is in the stream, too, wherever it goes and while it sleeps. Where it jumps by more than a
  // quarter of the largest half size, or opening another stream takes longer than half a second and
  // as long as it takes for that way, bodies around it may come some ticks later. NOT_FOUND if there is no
  // such body.
  std::optional<BodyId> follow;
  std::uint32_t every_ticks = 1;  // only ticks that are multiples of this
  bool only_awake = false;
  // Each frame has all bodies that match, at the cost of memory and time here, but of no bytes on the way.
  bool complete = false;
  // Positions are sent with an error of at most this (m, 1e-6 to 1), orientations with one of at most as many
  // rad, in some 10 bytes a body in the place of 114; 0: all digits. INVALID_ARGUMENT.
  double precision = 0;
  // With a precision, velocities are sent with an error of at most this (m/s and rad/s, 1e-6 to 1000), or,
  // if it is 0, not at all: they are then zero.
  double velocity_precision = 0;
  // Of all servers together, which share it evenly, in wall time: from 10,000 for each of them. Of what has
  // changed beyond that, later frames tell, as it is then: first what has waited longest, sooner what is near
  // the centre of the region. Bodies that change servers may be gone for some frames. While the world is
  // paused, nothing more is told. 0: no limit. INVALID_ARGUMENT.
  std::uint64_t bytes_per_second = 0;
};

struct BodySample {
  BodyId id;
  WorldPose pose;                                              // of the body frame
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   // of the centre of mass, m/s
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s
  bool asleep = false;
  std::uint64_t server = 0;  // the node that hosts it
};

// What has changed since the frame before: bodies that are awake, have fallen asleep, have been moved, or are
// new to the stream; the first frame has all. A body at rest is in no frame until it wakes or is moved.
struct BodyFrame {
  Tick tick = 0;
  std::vector<BodySample> bodies;  // ascending by id; with BodyFilter::complete all that match
  std::vector<BodyId> gone;        // of earlier frames: removed, or no longer matching the filter; ascending
  std::uint64_t deferred = 0;  // bodies that have changed and are told later: BodyFilter::bytes_per_second
};

struct ContactFilter {
  std::vector<BodyId> ids;  // contacts with any of these; empty: all
  bool persisting = false;  // also contacts that neither begin nor end
  std::uint32_t mask = 0;   // only those with a body of any of these collision categories; 0: all
  // If not 0: each pair in every tick in which its normal impulses are together at least that, N s, whatever
  // its phase, and no ends. A body of mass m at rest has m g dt in each tick. INVALID_ARGUMENT below 0.
  double impulse_min = 0;
};

struct ContactPointSample {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // m, from the position of the contact, on b
  double depth = 0;                                  // m, > 0 where the bodies overlap
  double impulse = 0;                                // N s, along the normal
};

// A patch of contact: points that share a normal. The phase is that of the pair: one that begins or goes on
// has a sample for each of its patches, and its end is one sample, without a patch. With `trigger` set, there
// is no contact: `b` overlaps a trigger of `a`, and nothing else is set.
struct ContactSample {
  ContactPhase phase = ContactPhase::kBegin;
  BodyId a;  // a < b, but for triggers
  BodyId b;
  WorldPosition position;                              // the deepest point, on b
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // on b, pointing to a
  double impulse = 0;                                  // N s, on a along the normal, of all points
  Eigen::Vector3d friction = Eigen::Vector3d::Zero();  // N s, on a, in the world's axes
  std::vector<ContactPointSample> points;
  bool trigger = false;
};

struct ContactFrame {
  Tick tick = 0;
  // Ascending by (a, b, phase), patches of a pair in one order; then those of triggers, likewise.
  std::vector<ContactSample> contacts;
};

// Selects what to watch at seams: clones of bodies, and islands across borders.
struct SeamFilter {
  std::optional<WatchedRegion> region;  // none: everywhere
  std::uint32_t every_ticks = 1;        // only ticks that are multiples of this
};

// A copy of a body in a sector other than its home, where contact with it is imminent.
struct CloneSample {
  BodyId body;
  SectorIndex sector;
  std::uint64_t server = 0;  // the node that hosts the sector
};

// An awake island across a border.
struct IslandSample {
  BodyId id;                   // the smallest id of its bodies
  std::vector<BodyId> bodies;  // those in the region, ascending
};

struct SeamFrame {
  Tick tick = 0;
  std::vector<CloneSample> clones;    // ascending by (body, sector)
  std::vector<IslandSample> islands;  // ascending by id
};

// Bodies that left the range of numbers, speeds or sectors in a tick, and were stopped.
struct DivergenceFrame {
  Tick tick = 0;
  std::vector<Divergence>
      divergences;  // ascending by (body, kind); of each server, the first kDivergencesKept
};

// Selects programs: those that match all of it.
struct ProgramFilter {
  std::vector<BodyId> ids = {};   // of bodies; empty: all that have programs
  std::string kind = {};          // "imu", or the name of a module; empty: all
  std::uint32_t every_ticks = 1;  // only ticks that are multiples of this
};

struct ProgramSample {
  BodyId body;
  std::uint32_t program = 0;  // its place on the body
  std::string kind;
  bool stopped = false;        // by a fault, which Client::programs() tells
  std::vector<double> values;  // its state; Client::programs() names them in this order
  Tick tick = 0;               // at whose end they were so: at most that of the frame
};

// The programs of bodies on which any has changed since the frame before; of all in the first frame, and
// again of some that have changed servers.
struct ProgramFrame {
  Tick tick = 0;
  std::vector<ProgramSample> programs;  // ascending by (body, program)
};

// A subscription; ends when it is destroyed. At most kFramesQueuedMax ticks per server are buffered here, and
// some thousands at the server; a reader that falls further behind loses the subscription
// (RESOURCE_EXHAUSTED). For one reading thread; any thread may call cancel().
template <typename Frame>
class Stream {
 public:
  virtual ~Stream() = default;

  // The next tick that all servers have reported: each once, in their order, also where the world loses
  // servers and goes on elsewhere. DEADLINE_EXCEEDED if none is complete in time (call again); any other
  // error ends the stream for good: UNAVAILABLE if the world ended with a server, or no coordinator answers
  // for 5 s, CANCELLED after cancel(), ABORTED if the world was unloaded or replaced, DATA_LOSS for corrupt
  // messages.
  virtual absl::StatusOr<Frame> next(absl::Duration timeout = absl::InfiniteDuration()) = 0;

  virtual void cancel() = 0;

  // The number of ticks so far that are missing: that only some of the servers reported, or of which a server
  // was lost before it had sent them to a client that was more than half a second behind.
  virtual std::uint64_t skipped() const = 0;
};

using BodyStream = Stream<BodyFrame>;
using ContactStream = Stream<ContactFrame>;
using SeamStream = Stream<SeamFrame>;
using DivergenceStream = Stream<DivergenceFrame>;
using ProgramStream = Stream<ProgramFrame>;

inline constexpr std::size_t kFramesQueuedMax = 256;

}  // namespace tessera
