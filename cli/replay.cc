#include "cli/replay.h"

#include <absl/container/btree_map.h>
#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "cli/interrupt.h"
#include "cli/local_cluster.h"
#include "cli/terminal.h"
#include "proto/convert.h"
#include "proto/recording_file.h"
#include "proto/snapshot_file.h"
#include "proto/status.h"
#include "simulator/simulated_cluster.h"
#include "tessera.grpc.pb.h"

namespace tessera::cli {
namespace {

using Stub = v1::Tessera::Stub;

// How each request is sent over the network.
template <typename Request, typename Answer>
using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Answer*);

constexpr std::tuple kMethods(&Stub::Load, &Stub::Step, &Stub::GetHash, &Stub::Spawn, &Stub::Remove,
                              &Stub::SetVelocity, &Stub::ApplyImpulse, &Stub::ApplyForce, &Stub::Teleport,
                              &Stub::SetKinematicTarget, &Stub::AddJoint, &Stub::RemoveJoint,
                              &Stub::SetJointDrives, &Stub::SetSurfaceMotion);

// Processes on this machine.
class NetworkCluster {
 public:
  static absl::StatusOr<NetworkCluster> start(int servers, int threads, Precision precision) {
    LocalClusterOptions options;
    options.servers = servers;
    options.threads = threads;
    options.precision = precision;
    options.interrupt_descriptor = interrupt_descriptor();
    absl::StatusOr<std::unique_ptr<LocalCluster>> processes = LocalCluster::start(options);
    if (!processes.ok()) return processes.status();
    return NetworkCluster(*std::move(processes));
  }

  absl::Status restore(const SnapshotChunks& chunks) {
    grpc::ClientContext context;
    v1::LoadReply reply;
    const auto stream = stub_->Restore(&context, &reply);
    SnapshotEncoder encoder;
    v1::RestoreRequest request;
    request.set_replace(true);
    for (const v1::SnapshotChunk& chunk : chunks) {
      absl::StatusOr<std::string> bytes = encoder.encode(chunk);
      if (!bytes.ok()) return bytes.status();
      request.set_bytes(*std::move(bytes));
      if (!stream->Write(request)) break;  // Finish() says why
    }
    stream->WritesDone();
    return from_grpc(stream->Finish());
  }

  template <typename Request, typename Answer>
  absl::StatusOr<Answer> call(const Request& request) {
    if (interrupted()) return absl::CancelledError("interrupted");
    grpc::ClientContext context;
    Answer answer;
    constexpr auto send = std::get<Method<Request, Answer>>(kMethods);
    const absl::Status status = from_grpc((stub_.get()->*send)(&context, request, &answer));
    if (!status.ok()) return status;
    return answer;
  }

 private:
  explicit NetworkCluster(std::unique_ptr<LocalCluster> processes) : processes_(std::move(processes)) {
    grpc::ChannelArguments arguments;
    arguments.SetMaxSendMessageSize(-1);
    stub_ = v1::Tessera::NewStub(
        grpc::CreateCustomChannel(processes_->address(), grpc::InsecureChannelCredentials(), arguments));
  }

  std::unique_ptr<LocalCluster> processes_;
  std::unique_ptr<Stub> stub_;
};

// What was recorded of one world. Hashes come in later than commands that were given meanwhile.
struct Section {
  v1::World world;
  SnapshotChunks snapshot;  // in the place of a world
  std::vector<v1::RecordedCommand> commands;
  absl::btree_map<Tick, std::string> hashes;
};

// The sections of a file, one at a time.
class SectionReader {
 public:
  static absl::StatusOr<SectionReader> open(const std::filesystem::path& file) {
    absl::StatusOr<RecordingReader> reader = RecordingReader::open(file);
    if (!reader.ok()) return reader.status();
    absl::StatusOr<std::optional<v1::RecordedInput>> first = reader->next();
    if (!first.ok()) return first.status();
    return SectionReader(*std::move(reader), *std::move(first));
  }

  // nullopt at the end. DATA_LOSS.
  absl::StatusOr<std::optional<Section>> next() {
    if (!ahead_) return std::nullopt;
    Section section;
    if (ahead_->has_world()) section.world = std::move(*ahead_->mutable_world());
    if (ahead_->has_snapshot()) section.snapshot.push_back(std::move(*ahead_->mutable_snapshot()));
    for (;;) {
      absl::StatusOr<std::optional<v1::RecordedInput>> input = reader_.next();
      if (!input.ok()) return input.status();
      ahead_ = *std::move(input);
      const bool begins = ahead_ && (ahead_->has_world() || ahead_->snapshot().has_head());
      if (!ahead_ || begins) return section;
      if (ahead_->has_snapshot()) section.snapshot.push_back(std::move(*ahead_->mutable_snapshot()));
      if (ahead_->has_command()) section.commands.push_back(std::move(*ahead_->mutable_command()));
      if (ahead_->has_hash()) section.hashes[ahead_->hash().tick()] = ahead_->hash().hash();
    }
  }

 private:
  SectionReader(RecordingReader reader, std::optional<v1::RecordedInput> first)
      : reader_(std::move(reader)), ahead_(std::move(first)) {}

  RecordingReader reader_;
  std::optional<v1::RecordedInput> ahead_;  // the world that comes next
};

// Recorded worlds on one cluster.
template <typename Cluster>
class Player {
 public:
  explicit Player(Cluster& cluster) : cluster_(cluster) {}

  const ReplayReport& report() const { return report_; }

  absl::Status play(const Section& section) {
    absl::Status loaded = section.snapshot.empty() ? load(section.world) : restore(section.snapshot);
    if (!loaded.ok()) return loaded;
    const Tick last = section.hashes.empty() ? 0 : section.hashes.rbegin()->first;
    ProgressBar progress(report_.world, last);
    auto hash = section.hashes.begin();
    for (const v1::RecordedCommand& command : section.commands) {
      for (; hash != section.hashes.end() && hash->first < command.tick(); ++hash) {
        if (absl::Status status = compare(hash->first, hash->second); !status.ok()) return status;
        progress.update(report_.tick);
      }
      if (absl::Status status = give(command); !status.ok()) return status;
    }
    for (; hash != section.hashes.end(); ++hash) {
      if (absl::Status status = compare(hash->first, hash->second); !status.ok()) return status;
      progress.update(report_.tick);
    }
    return absl::OkStatus();
  }

 private:
  absl::Status load(const v1::World& world) {
    v1::LoadRequest request;
    *request.mutable_world() = world;
    request.set_replace(true);
    report_.world = world.name();
    report_.tick = 0;
    return cluster_.template call<v1::LoadRequest, v1::LoadReply>(request).status();
  }

  absl::Status restore(const SnapshotChunks& snapshot) {
    report_.world = snapshot.front().head().name();
    report_.tick = snapshot.front().head().tick();
    return cluster_.restore(snapshot);
  }

  absl::Status run_to(Tick tick) {
    if (tick <= report_.tick) return absl::OkStatus();
    v1::StepRequest request;
    request.set_ticks(tick - report_.tick);
    report_.tick = tick;
    return cluster_.template call<v1::StepRequest, v1::StepReply>(request).status();
  }

  absl::Status give(const v1::RecordedCommand& command) {
    if (absl::Status status = run_to(command.tick() - 1); !status.ok()) return status;
    ++report_.commands;
    using Kind = v1::RecordedCommand::RequestCase;
    switch (command.request_case()) {
      case Kind::kSpawn:
        return send<v1::SpawnReply>(command, command.spawn());
      case Kind::kRemove:
        return send<v1::CommandReply>(command, command.remove());
      case Kind::kSetVelocity:
        return send<v1::CommandReply>(command, command.set_velocity());
      case Kind::kApplyImpulse:
        return send<v1::CommandReply>(command, command.apply_impulse());
      case Kind::kApplyForce:
        return send<v1::CommandReply>(command, command.apply_force());
      case Kind::kTeleport:
        return send<v1::CommandReply>(command, command.teleport());
      case Kind::kKinematicTarget:
        return send<v1::CommandReply>(command, command.kinematic_target());
      case Kind::kAddJoint:
        return send<v1::AddJointReply>(command, command.add_joint());
      case Kind::kRemoveJoint:
        return send<v1::CommandReply>(command, command.remove_joint());
      case Kind::kSetJointDrives:
        return send<v1::CommandReply>(command, command.set_joint_drives());
      case Kind::kSurfaceMotion:
        return send<v1::CommandReply>(command, command.surface_motion());
      case Kind::REQUEST_NOT_SET:
        break;
    }
    return absl::DataLossError(absl::StrCat("tick ", command.tick(), ": a command of an unknown kind"));
  }

  template <typename Answer, typename Request>
  absl::Status send(const v1::RecordedCommand& command, const Request& request) {
    const absl::StatusOr<Answer> answer = cluster_.template call<Request, Answer>(request);
    if (!answer.ok()) {
      return absl::AbortedError(absl::StrCat("tick ", command.tick(),
                                             ": a command that was taken when it was ",
                                             "recorded is refused: ", answer.status().message()));
    }
    if (answer->tick() != command.tick()) {
      return absl::AbortedError(absl::StrCat("tick ", command.tick(), ": a command takes effect at tick ",
                                             answer->tick(), " instead"));
    }
    if constexpr (requires { answer->id(); }) {
      if (answer->id() != command.id()) {
        return absl::AbortedError(absl::StrCat("tick ", command.tick(), ": a new body or joint has the id ",
                                               answer->id(), ", and had ", command.id()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status compare(Tick tick, const std::string& recorded) {
    if (absl::Status status = run_to(tick); !status.ok()) return status;
    const auto now = cluster_.template call<v1::HashRequest, v1::HashReply>(v1::HashRequest());
    if (!now.ok()) return now.status();
    if (now->hash() != recorded) {
      return absl::AbortedError(absl::StrCat("tick ", tick, ": the world has the hash ", now->hash(),
                                             ", and had ", recorded, " when it was recorded"));
    }
    ++report_.hashes;
    return absl::OkStatus();
  }

  Cluster& cluster_;
  ReplayReport report_;
};

template <typename Cluster>
absl::StatusOr<ReplayReport> play_all(Section section, SectionReader& rest, Cluster& cluster) {
  Player<Cluster> player(cluster);
  for (;;) {
    if (absl::Status status = player.play(section); !status.ok()) return status;
    absl::StatusOr<std::optional<Section>> next = rest.next();
    if (!next.ok()) return next.status();
    if (!*next) return player.report();
    section = **std::move(next);
  }
}

}  // namespace

absl::StatusOr<ReplayReport> replay(const ReplayOptions& options) {
  absl::StatusOr<SectionReader> reader = SectionReader::open(options.file);
  if (!reader.ok()) return reader.status();
  absl::StatusOr<std::optional<Section>> first = reader->next();
  if (!first.ok()) return first.status();
  const v1::WorldSettings& settings =
      (*first)->snapshot.empty() ? (*first)->world.settings() : (*first)->snapshot.front().head().settings();
  const absl::StatusOr<Precision> precision = from_proto(settings.precision());
  if (!precision.ok()) return precision.status();
  if (options.servers == 0) {
    SimulatedCluster cluster(/*seed=*/1, /*servers=*/1, *precision);
    cluster.end_when(interrupted);
    return play_all(**std::move(first), *reader, cluster);
  }
  absl::StatusOr<NetworkCluster> cluster =
      NetworkCluster::start(options.servers, options.threads, *precision);
  if (!cluster.ok()) return cluster.status();
  return play_all(**std::move(first), *reader, *cluster);
}

}  // namespace tessera::cli
