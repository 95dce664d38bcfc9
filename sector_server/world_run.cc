#include "sector_server/world_run.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <span>

#include "lpss/base/freed_memory.h"
#include "lpss/base/invariant.h"
#include "lpss/model/checks.h"
#include "lpss/model/validate.h"
#include "lpss/observe/load.h"
#include "lpss/observe/queries.h"
#include "lpss/observe/state.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/simulation/record_checks.h"
#include "lpss/simulation/simulation.h"
#include "lpss/tick/commands.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"
#include "proto/snapshot.h"
#include "proto/wire.h"

namespace tessera {
namespace {

// Reports are sent in bundles: they only open the window of grants.
constexpr std::size_t kTicksPerReport = 8;

// What may wait here: grants, and rounds of ticks to come. A coordinator is some ticks ahead of its slowest
// server, and a server some rounds ahead of the others.
constexpr std::uint64_t kGrantsAheadMax = 65'536;
constexpr std::size_t kRoundsAheadMax = 65'536;

// Sectors, how far from a probe bodies are searched for: as far as the coordinator allows.
constexpr double kNearReachMax = 4;
constexpr double kUnitTolerance = 1e-6;

// Sectors that have been packed since freed memory was given back.
constexpr std::size_t kPackedToGiveBack = 1024;

constexpr Tick kUsualTicks = 64;  // that a mean of the last ones looks back

absl::StatusOr<SectorMap> read_map(const SectorIndex& anchor,
                                   const google::protobuf::RepeatedPtrField<v1::SectorIndex>& messages,
                                   const google::protobuf::RepeatedField<std::uint32_t>& owners,
                                   std::size_t servers, std::uint64_t epoch) {
  std::vector<SectorIndex> splitters;
  for (const v1::SectorIndex& splitter : messages) splitters.push_back(from_proto(splitter));
  return SectorMap::checked(anchor, std::move(splitters), {owners.begin(), owners.end()}, servers, epoch);
}

absl::StatusOr<Shape> probe_of(const v1::NearQuery& query) {
  v1::Shape probe;
  *probe.add_parts()->mutable_geometry() = query.probe();
  absl::StatusOr<Shape> shape = from_proto(probe);
  if (!shape.ok()) return shape.status();
  if (absl::Status status = validate(*shape, "probe"); !status.ok()) return status;
  return shape;
}

absl::Status check(const v1::Query& query, double sector_size) {
  if (query.has_ray()) {
    const Eigen::Vector3d direction = from_proto(query.ray().direction());
    if (absl::Status status = finite("origin", from_proto(query.ray().origin()).local); !status.ok())
      return status;
    if (absl::Status status = finite("direction", direction); !status.ok()) return status;
    if (std::abs(direction.norm() - 1) > kUnitTolerance)
      return refused("a ray's direction has no unit length");
    return bounded("length", query.ray().length(), 0, kRayLengthMax, "m");
  }
  if (query.has_load()) return bounded("time ahead", query.load().ahead(), 0, kNoBound, "s");
  if (!query.has_near()) return absl::OkStatus();
  // As for a body.
  const absl::StatusOr<Shape> shape = probe_of(query.near());
  if (!shape.ok()) return shape.status();
  BodyDescription probe;
  probe.name = "probe";
  probe.properties.motion = Motion::kKinematic;
  probe.pose = from_proto(query.near().pose());
  WorldSettings settings;
  settings.sector_size = sector_size;
  if (absl::Status status = validate(probe, *shape, settings); !status.ok()) return status;
  return bounded("reach", query.near().reach(), 0, kNearReachMax * sector_size, "m");
}

}  // namespace

absl::StatusOr<std::unique_ptr<WorldRun>> WorldRun::create(const v1::LoadWorld& load, NodeId self,
                                                           int threads, const MakeEngine& make_engine,
                                                           Send send) {
  std::unique_ptr<WorldRun> run(new WorldRun());
  run->world_ = load.world();
  run->hash_ticks_ = load.hash_ticks();
  run->send_ = std::move(send);
  run->node_ = self;
  run->threads_ = threads;
  for (const std::uint64_t node : load.nodes()) run->nodes_.push_back(NodeId{node});
  const auto place = std::find(run->nodes_.begin(), run->nodes_.end(), self);
  if (place == run->nodes_.end() && !load.has_guest())
    return absl::InvalidArgumentError("the world's list of servers lacks this one");
  if (place != run->nodes_.end() && load.has_guest())
    return absl::InvalidArgumentError("the world's list of servers has this one, which is a guest");
  // Of a guest, that of nobody: it hosts no sector.
  run->self_ = static_cast<Rank>(place - run->nodes_.begin());

  absl::StatusOr<WorldSettings> settings = from_proto(load.settings());
  if (!settings.ok()) return settings.status();
  if (absl::Status status = validate(*settings); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<Engine>> engine = make_engine(engine_settings(*settings));
  if (!engine.ok()) return engine.status();
  run->engine_ = std::move(*engine);

  const SectorIndex anchor = from_proto(load.anchor());
  absl::StatusOr<SectorMap> map =
      read_map(anchor, load.splitters(), load.owners(), run->nodes_.size(), load.map_epoch());
  if (!map.ok()) return map.status();
  PartitionOptions options;
  options.settings = *settings;
  options.anchor = anchor;
  options.map = *std::move(map);
  options.self = run->self_;
  run->map_epoch_ = run->reported_map_ = load.map_epoch();
  run->partition_ = std::make_unique<Partition>(std::move(options), *run->engine_);
  if (absl::Status status = run->add_shapes(load.shapes()); !status.ok()) return status;
  if (load.has_restored()) {
    if (absl::Status status = run->restore(load.restored()); !status.ok()) return status;
  } else if (absl::Status status = run->fill(load); !status.ok()) {
    return status;
  }
  if (!load.has_guest()) {
    run->join(run->self_);
    return run;
  }
  for (const v1::Grant& past : load.guest().past()) {
    if (absl::Status status = run->add_shapes(past.new_shapes()); !status.ok()) return status;
    if (absl::Status status = run->follow(past); !status.ok()) return status;
  }
  run->next_serial_ = load.guest().serial();
  return run;
}

void WorldRun::join(Rank self) {
  self_ = self;
  machine_ = std::make_unique<TickMachine>(
      *partition_, TickMachine::Options{.parallel = parallel_on(threads_), .tick = tick_});
}

void WorldRun::welcome(NodeId guest) {
  if (std::find(guests_.begin(), guests_.end(), guest) != guests_.end()) return;
  if (guests_.size() == kServersMax) guests_.erase(guests_.begin());
  guests_.push_back(guest);
}

absl::Status WorldRun::fill(const v1::LoadWorld& load) {
  absl::StatusOr<std::vector<BodyRecord>> records = unpack_records(load.records());
  if (!records.ok()) return records.status();
  const absl::StatusOr<std::vector<JointRecord>> joints = unpack_joints(load.joints());
  if (!joints.ok()) return joints.status();
  if (absl::Status status = check(*partition_, *records, *joints); !status.ok()) return status;
  for (const BodyRecord& record : *records) add_body(*partition_, record);
  add_joints(*partition_, *joints);
  absl::Status status = bounded("the largest radius", load.radius_max(), 0, partition_->sector_size(), "m");
  if (!status.ok()) return status;
  expect_radius(*partition_, load.radius_max());
  return absl::OkStatus();
}

absl::Status WorldRun::restore(const v1::Restored& restored) {
  absl::StatusOr<SharedState> shared = unpack_shared(restored.shared());
  if (!shared.ok()) return shared.status();
  std::vector<MovedSector> sectors;
  for (const std::string& list : restored.sectors()) {
    absl::StatusOr<std::vector<MovedSector>> some = unpack_sectors(list);
    if (!some.ok()) return some.status();
    std::move(some->begin(), some->end(), std::back_inserter(sectors));
  }
  if (absl::Status status = check(*partition_, *shared, sectors); !status.ok()) return status;
  tick_ = restored.tick();
  if (self_ == nodes_.size()) {
    // A guest does not hear what has become of these; it is told once it takes part.
    shared->known_replicas.clear();
  }
  return resume(*partition_, *shared, sectors);
}

absl::Status WorldRun::add_shapes(const google::protobuf::RepeatedPtrField<v1::NumberedShape>& shapes) {
  for (const v1::NumberedShape& message : shapes) {
    absl::StatusOr<Shape> shape = from_proto(message.shape());
    if (!shape.ok()) return shape.status();
    const std::string title = absl::StrCat("shape ", message.id());
    if (absl::Status status = validate(*shape, title); !status.ok()) return status;
    if (partition_->shapes.contains(message.id()))
      return absl::InvalidArgumentError(absl::StrCat(title, " is there already"));
    if (absl::Status status = open_grounds(std::span<const Shape>(&*shape, 1)); !status.ok()) return status;
    add_shape(*partition_, message.id(), std::make_shared<const Shape>(*std::move(shape)));
  }
  return absl::OkStatus();
}

absl::Status WorldRun::take(v1::Grant grant) {
  const std::uint64_t serial = grant.serial();
  if (serial < next_serial_ || serial - next_serial_ >= kGrantsAheadMax) {
    return absl::InvalidArgumentError(absl::StrCat("grant ", serial, " is not one of the ", kGrantsAheadMax,
                                                   " from ", next_serial_, " on"));
  }
  for (const v1::Query& query : grant.queries()) {
    if (absl::Status status = check(query, partition_->sector_size()); !status.ok())
      return in(absl::StrCat("a query of grant ", serial), status);
  }
  grants_.insert_or_assign(serial, std::move(grant));
  return absl::OkStatus();
}

absl::Status WorldRun::take(NodeId from, v1::Round round) {
  const auto is_from = [&](const std::vector<NodeId>& nodes) {
    return std::find(nodes.begin(), nodes.end(), from) != nodes.end();
  };
  if (!is_from(nodes_) && !is_from(guests_))
    return absl::InvalidArgumentError(
        absl::StrCat("a round from ", from.value, ", which is not a server of this world"));
  // It may be any number of ticks ahead: a world at rest needs no messages, so its servers proceed at their
  // own pace.
  if (round.tick() <= tick_) {
    return absl::InternalError(
        absl::StrCat("a message of tick ", round.tick(), " arrived after tick ", tick_));
  }
  const RoundKey key{round.tick(), round.map_epoch(), round.number()};
  if (inboxes_.size() >= kRoundsAheadMax && !inboxes_.contains(key)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("messages of ", kRoundsAheadMax, " rounds already wait for their turn"));
  }
  if (!inboxes_[key].try_emplace(from.value, std::move(*round.mutable_body())).second)
    return absl::InternalError(absl::StrCat("a message of tick ", round.tick(), " arrived twice"));
  return absl::OkStatus();
}

WorldRun::RoundKey WorldRun::current_round() const { return {tick_ + 1, moving_, round_->number}; }

// Whether all messages that the current tick waits for have arrived.
bool WorldRun::has_all() const {
  const auto inbox = inboxes_.find(current_round());
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || !round_->from[rank]) continue;
    if (inbox == inboxes_.end() || !inbox->second.contains(nodes_[rank].value)) return false;
  }
  return true;
}

bool WorldRun::ready() const {
  if (has_left_) return false;
  if (round_) return has_all();
  return grant_.has_value() || grants_.contains(next_serial_);
}

absl::Status WorldRun::proceed(const std::function<Nanoseconds()>& clock) {
  return round_ ? advance(clock) : next_grant_or_tick(clock);
}

absl::Status WorldRun::next_grant_or_tick(const std::function<Nanoseconds()>& clock) {
  if (!grant_) {
    const auto next = grants_.find(next_serial_);
    grant_ = std::move(next->second);
    grants_.erase(next);
    ++next_serial_;
    ticks_left_ = grant_->ticks();
    next_query_ = 0;
    changes_map_ = grant_->has_map();
    if (absl::Status status = add_shapes(grant_->new_shapes()); !status.ok()) return status;
  }
  if (std::exchange(changes_map_, false)) return change_map(grant_->map(), clock);
  if (is_guest()) {
    const v1::Grant grant = *std::exchange(grant_, std::nullopt);
    return follow(grant);
  }
  if (ticks_left_ > 0) return begin_tick(clock);
  // One a turn, so that nothing else has to wait for all of them.
  if (next_query_ < grant_->queries_size()) answer(grant_->queries(next_query_++));
  if (next_query_ == grant_->queries_size()) grant_.reset();
  return absl::OkStatus();
}

absl::Status WorldRun::begin_tick(const std::function<Nanoseconds()>& clock) {
  tick_began_ = clock() - std::exchange(move_time_, {});
  own_time_ = std::exchange(move_own_time_, {});
  ground_waits_ = TileStore::of_process().counts().waits;
  std::vector<Command> commands;
  if (ticks_left_ == grant_->ticks()) {
    absl::StatusOr<std::vector<Command>> granted = unpack_commands(grant_->commands());
    if (!granted.ok()) return granted.status();
    commands = std::move(*granted);
    if (absl::Status status = check(*partition_, commands); !status.ok()) return status;
  }
  --ticks_left_;
  go_on(machine_->begin_tick(commands), tick_began_, clock);
  return absl::OkStatus();
}

// Before the next tick: a round of its own, in which sectors change servers.
absl::Status WorldRun::change_map(const v1::SectorMap& message, const std::function<Nanoseconds()>& clock) {
  const Nanoseconds began = clock();
  const std::vector<NodeId> before = nodes_;
  if (message.nodes_size() > 0) {
    nodes_.clear();
    for (const std::uint64_t node : message.nodes()) nodes_.push_back(NodeId{node});
  }
  absl::StatusOr<SectorMap> map =
      read_map(partition_->anchor, message.splitters(), message.owners(), nodes_.size(), message.epoch());
  if (!map.ok()) return map.status();
  if (message.epoch() <= map_epoch_)
    return absl::InvalidArgumentError(absl::StrCat("the sector map of epoch ", map_epoch_,
                                                   " was to be followed by one of epoch ", message.epoch()));
  if (nodes_.size() > kServersMax || message.newcomers() >= nodes_.size())
    return absl::InvalidArgumentError(absl::StrCat("the sector map has ", nodes_.size(),
                                                   " servers, of which ", message.newcomers(),
                                                   " take part from now on"));
  const auto place = std::find(nodes_.begin(), nodes_.end(), node_);
  const auto self = static_cast<Rank>(place - nodes_.begin());
  if (place == nodes_.end()) {
    if (is_guest()) {
      self_ = partition_->self = self;
      partition_->map = *std::move(map);
      return absl::OkStatus();
    }
    if (!partition_->sectors.empty() || partition_->packed.counts().sectors > 0)
      return absl::InvalidArgumentError("a server that hosts sectors was to leave its world");
    has_left_ = true;
    return absl::OkStatus();
  }
  if (self >= nodes_.size() - message.newcomers() && !is_guest())
    return absl::InvalidArgumentError("a server of the world was to begin to take part in it");
  if (nodes_ != before || is_guest()) {
    new_servers_ = {.since = tick_ + 1, .servers = nodes_.size(), .subscriptions = {}};
    if (is_guest())
      new_servers_->subscriptions = {message.subscriptions().begin(), message.subscriptions().end()};
  }
  if (is_guest()) join(self);
  self_ = self;
  moving_ = message.epoch();
  own_time_ = {};
  tick_began_ = began;
  go_on(machine_->change_map({*std::move(map), self_, message.newcomers()}), began, clock);
  return absl::OkStatus();
}

void WorldRun::end_move(Nanoseconds now) {
  // Of the tick that follows, others may have sent something already.
  inboxes_.erase(inboxes_.lower_bound({tick_ + 1, moving_, 0}),
                 inboxes_.upper_bound({tick_ + 1, moving_, UINT32_MAX}));
  map_epoch_ = std::exchange(moving_, 0);
  move_time_ += now - tick_began_;
  move_own_time_ += own_time_;
}

// What a guest does of a grant: it hosts nothing that moves, so its ticks cost nothing.
absl::Status WorldRun::follow(const v1::Grant& grant) {
  if (grant.ticks() == 0) return absl::OkStatus();
  const absl::StatusOr<std::vector<Command>> commands = unpack_commands(grant.commands());
  if (!commands.ok()) return commands.status();
  if (absl::Status status = check(*partition_, *commands); !status.ok()) return status;
  std::vector<Stopped> stopped;
  apply_commands(*partition_, *commands, stopped);
  tick_ += grant.ticks();
  return absl::OkStatus();
}

absl::Status WorldRun::advance(const std::function<Nanoseconds()>& clock) {
  const Nanoseconds began = clock();
  std::vector<std::optional<RoundMessage>> messages(nodes_.size());
  messages[self_] = std::move(round_->to[self_]);
  const auto inbox = inboxes_.find(current_round());
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || !round_->from[rank]) continue;
    absl::StatusOr<RoundMessage> message = unpack_round(inbox->second.at(nodes_[rank].value));
    if (!message.ok()) return message.status();
    if (!machine_->awaits(*message)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "node ", absl::Hex(nodes_[rank].value), " sent a message of another kind than that of its round"));
    }
    traffic_.received[message->index()].add(inbox->second.at(nodes_[rank].value).size());
    messages[rank] = std::move(*message);
  }
  go_on(machine_->advance(std::move(messages)), began, clock);
  return absl::OkStatus();
}

// `began`: when the work on this round did.
void WorldRun::go_on(std::optional<Round> round, Nanoseconds began,
                     const std::function<Nanoseconds()>& clock) {
  round_ = std::move(round);
  if (round_) send(*round_);
  const Nanoseconds now = clock();
  own_time_ += now - began;
  if (round_) return;
  if (moving_ != 0) {
    end_move(now);
  } else {
    end_tick(now);
  }
}

RoundTraffic WorldRun::Traffic::all_sent() const {
  RoundTraffic sum;
  for (const RoundTraffic& round : sent) {
    sum.messages += round.messages;
    sum.bytes += round.bytes;
  }
  return sum;
}

std::uint64_t WorldRun::moved_bytes() const { return traffic_.sent[RoundMessage(Transfer{}).index()].bytes; }

void WorldRun::send(const Round& round) {
  std::string packed;
  const RoundMessage* before = nullptr;
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || !round.to[rank]) continue;
    // Where all servers get the same seams, these are packed once.
    const auto seams_in = [](const RoundMessage& message) {
      const auto* seams = std::get_if<std::shared_ptr<const Seams>>(&message);
      return seams != nullptr ? seams->get() : nullptr;
    };
    const Seams* const seams = seams_in(*round.to[rank]);
    const bool same = before != nullptr && seams != nullptr && seams == seams_in(*before);
    if (!same) packed = pack(*round.to[rank]);
    before = &*round.to[rank];
    traffic_.sent[before->index()].add(packed.size());
    v1::ClusterMessage message;
    v1::Round& letter = *message.mutable_round();
    letter.set_world(world_);
    letter.set_tick(tick_ + 1);
    letter.set_number(round.number);
    letter.set_map_epoch(moving_);
    letter.set_body(packed);
    send_(nodes_[rank], message);
  }
}

void WorldRun::end_tick(Nanoseconds now) {
  ++tick_;
  const std::chrono::duration<double, std::micro> own = own_time_;
  const std::chrono::duration<double, std::micro> wait = now - tick_began_ - own_time_;
  const auto ticks = static_cast<double>(std::min(++ticks_here_, kUsualTicks));
  usual_own_us_ += (own.count() - usual_own_us_) / ticks;
  usual_wait_us_ += (wait.count() - usual_wait_us_) / ticks;
  inboxes_.erase(inboxes_.begin(), inboxes_.lower_bound({tick_ + 1, 0, 0}));
  tick_done_ = true;
  give_back_memory();

  if (TileStore::of_process().counts().waits != ground_waits_) ++ticks_waited_for_ground_;
  v1::TickReport& report = last_report_;
  report.set_tick(tick_);
  report.set_work_us(static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(now - tick_began_).count()));
  report.set_own_us(
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(own_time_).count()));
  write(machine_->counts(), *report.mutable_counts());
  report.clear_divergences();
  for (const Divergence& divergence : first_divergences(machine_->divergences()))
    *report.add_divergences() = to_proto(divergence);
  if (hash_ticks_) {
    const WorldHash hash = hash_of(*partition_);
    report.set_hash_low(hash.low());
    report.set_hash_high(hash.high());
  }
  reports_.push_back(report);
}

// What packing has freed is of no use to the next tick.
void WorldRun::give_back_memory() {
  const std::size_t packed = partition_->packed.counts().sectors;
  const bool goes_on = packed > std::exchange(packed_before_, packed);
  packed_given_back_ = std::min(packed_given_back_, packed);
  if (goes_on || packed < packed_given_back_ + kPackedToGiveBack) return;
  packed_given_back_ = packed;
  give_back_freed_memory();
}

bool WorldRun::report_due() const {
  const bool idle = !round_ && !grant_ && !grants_.contains(next_serial_);
  return reports_.size() >= kTicksPerReport || (idle && !reports_.empty()) || reported_map_ != map_epoch_;
}

void WorldRun::answer(const v1::Query& query) {
  v1::ClusterMessage message;
  v1::Answer& answer = *message.mutable_answer();
  answer.set_world(world_);
  answer.set_query(query.id());
  answer.set_tick(tick_);
  if (query.has_hash()) {
    const WorldHash hash = hash_of(*partition_);
    answer.set_hash_low(hash.low());
    answer.set_hash_high(hash.high());
  } else if (query.has_ray()) {
    const v1::RayQuery& ray = query.ray();
    const std::optional<RayAnswer> hit =
        raycast(*partition_, from_proto(ray.origin()), from_proto(ray.direction()), ray.length(), ray.mask());
    answer.set_hit(hit.has_value());
    if (hit) {
      answer.set_body(hit->body.value);
      answer.set_distance(hit->distance);
      *answer.mutable_normal() = to_proto(hit->normal);
    }
  }
  if (query.has_snapshot()) return answer_with_snapshot(query);
  if (query.has_load()) write_load(query.load().ahead(), *answer.mutable_load());
  if (query.has_near()) {
    for (const NearBody& near : nearby(query.near())) {
      v1::NearBody& body = *answer.add_near();
      body.set_body(near.body.value);
      body.set_distance(near.distance);
    }
  }
  send_(kCoordinatorNode, message);
}

// The state that all share comes from the first server.
std::vector<v1::SnapshotChunk> WorldRun::snapshot_chunks() const {
  SectorChunks sectors;
  for_each_sector(*partition_, [&](MovedSector sector) { sectors.add(std::move(sector)); });
  std::vector<v1::SnapshotChunk> chunks = sectors.finish();
  if (self_ == 0) chunks.insert(chunks.begin(), shared_chunk(shared_state(*partition_)));
  return chunks;
}

// In answers of about the size of a chunk.
void WorldRun::answer_with_snapshot(const v1::Query& query) {
  std::vector<v1::ClusterMessage> answers;
  std::size_t room = 0;
  const auto take = [&](v1::SnapshotChunk chunk) {
    if (room == 0) {
      answers.emplace_back();
      room = kSnapshotChunkBytes;
    }
    room -= std::min(room, chunk.ByteSizeLong());
    *answers.back().mutable_answer()->add_snapshot() = std::move(chunk);
  };
  if (query.snapshot().keeps()) {
    changed_chunks_.collect(*partition_, query.snapshot().anew(), self_ == 0, take);
  } else {
    for (v1::SnapshotChunk& chunk : snapshot_chunks()) take(std::move(chunk));
  }
  if (answers.empty()) answers.emplace_back();
  for (v1::ClusterMessage& message : answers) {
    v1::Answer& answer = *message.mutable_answer();
    answer.set_world(world_);
    answer.set_query(query.id());
    answer.set_tick(tick_);
    answer.set_parts(static_cast<std::uint32_t>(answers.size()));
    send_(kCoordinatorNode, message);
  }
}

void WorldRun::write_load(double ahead, v1::ServerLoad& answer) {
  for (const LoadPiece& piece : load_along_curve(*partition_, ahead, kLoadPiecesMax)) {
    v1::LoadPiece& message = *answer.add_pieces();
    *message.mutable_first() = to_proto(piece.first);
    message.set_level(piece.level);
    message.set_work(piece.work);
    message.set_sectors(piece.sectors);
    message.set_bodies(piece.bodies);
  }
  answer.set_tick_us(usual_own_us_);
  answer.set_wait_us(std::max(usual_wait_us_, 0.0));
}

std::vector<NearBody> WorldRun::nearby(const v1::NearQuery& query) {
  const absl::StatusOr<Shape> shape = probe_of(query);
  invariant(shape.ok(), "queries are checked as they come");
  return bodies_near(*partition_, shape->parts.front().geometry, from_proto(query.pose()), query.reach(),
                     query.mask());
}

}  // namespace tessera
