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

constexpr std::tuple kMethods(&Stub::Load, &Stub::Do);

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

  absl::Status restore(const SnapshotChunks& chunks, bool replay) {
    grpc::ClientContext context;
    v1::LoadReply reply;
    const auto stream = stub_->Restore(&context, &reply);
    SnapshotEncoder encoder;
    v1::RestoreRequest request;
    request.set_replace(true);
    request.set_replay(replay);
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
  std::vector<v1::RecordedCommands> commands;
  absl::btree_map<Tick, v1::RecordedHash> hashes;
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
      if (ahead_->has_commands()) section.commands.push_back(std::move(*ahead_->mutable_commands()));
      if (ahead_->has_hash()) section.hashes[ahead_->hash().tick()] = ahead_->hash();
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
    for (const v1::RecordedCommands& commands : section.commands) {
      for (; hash != section.hashes.end() && hash->first < commands.tick(); ++hash) {
        if (absl::Status status = compare(hash->first, hash->second); !status.ok()) return status;
        progress.update(report_.tick);
      }
      if (absl::Status status = give(commands); !status.ok()) return status;
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
    request.set_replay(true);
    report_.world = world.name();
    report_.tick = 0;
    return cluster_.template call<v1::LoadRequest, v1::LoadReply>(request).status();
  }

  absl::Status restore(const SnapshotChunks& snapshot) {
    report_.world = snapshot.front().head().name();
    report_.tick = snapshot.front().head().tick();
    return cluster_.restore(snapshot, /*replay=*/true);
  }

  absl::Status run_to(Tick tick) {
    if (tick <= report_.tick) return absl::OkStatus();
    v1::Request request;
    request.set_ticks(tick - report_.tick);
    report_.tick = tick;
    return cluster_.template call<v1::Request, v1::Reply>(request).status();
  }

  absl::Status give(const v1::RecordedCommands& recorded) {
    if (absl::Status status = run_to(recorded.tick() - 1); !status.ok()) return status;
    report_.commands += static_cast<std::uint64_t>(recorded.commands_size());
    v1::Request request;
    *request.mutable_commands() = recorded.commands();
    const absl::StatusOr<v1::Reply> reply = cluster_.template call<v1::Request, v1::Reply>(request);
    if (!reply.ok()) {
      return absl::AbortedError(absl::StrCat("tick ", recorded.tick(),
                                             ": commands that were taken when they ",
                                             "were recorded are refused: ", reply.status().message()));
    }
    if (reply->applied().tick() != recorded.tick()) {
      return absl::AbortedError(absl::StrCat("tick ", recorded.tick(), ": commands take effect at tick ",
                                             reply->applied().tick(), " instead"));
    }
    return check_ids(recorded, reply->applied());
  }

  // Ids follow from those that come next before the list.
  static absl::Status check_ids(const v1::RecordedCommands& recorded, const v1::Applied& applied) {
    std::uint64_t body = recorded.next_body();
    std::uint64_t joint = recorded.next_joint();
    for (const v1::Created& created : applied.created()) {
      const bool other_body = created.bodies() > 0 && created.first_body() != body;
      const bool other_joint = created.joints() > 0 && created.first_joint() != joint;
      if (other_body || other_joint) {
        return absl::AbortedError(absl::StrCat("tick ", recorded.tick(), ": a new ",
                                               other_body ? "body" : "joint", " has the id ",
                                               other_body ? created.first_body() : created.first_joint(),
                                               ", and had ", other_body ? body : joint));
      }
      body += created.bodies();
      joint += created.joints();
    }
    return absl::OkStatus();
  }

  absl::Status compare(Tick tick, const v1::RecordedHash& recorded) {
    if (absl::Status status = run_to(tick); !status.ok()) return status;
    v1::Request request;
    request.add_queries()->mutable_hash();
    const absl::StatusOr<v1::Reply> now = cluster_.template call<v1::Request, v1::Reply>(request);
    if (!now.ok()) return now.status();
    const v1::HashResult& hash = now->results(0).hash();
    const auto differs = [tick](absl::string_view what, const std::string& is, const std::string& was) {
      return absl::AbortedError(absl::StrCat("tick ", tick, ": ", what, " the hash ", is, ", and had ", was,
                                             " when it was recorded"));
    };
    if (hash.hash() != recorded.hash()) return differs("the world has", hash.hash(), recorded.hash());
    // Earlier recordings have none of programs.
    if (!recorded.programs().empty() && hash.programs() != recorded.programs())
      return differs("its programs have", hash.programs(), recorded.programs());
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
