#include "sector_server/world_run.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "lpss/world/simulation.h"
#include "proto/convert.h"
#include "proto/wire.h"

namespace tessera {
namespace {

// Reports travel in bundles: they only open the window of grants.
constexpr std::size_t kTicksPerReport = 8;

}  // namespace

absl::StatusOr<std::unique_ptr<WorldRun>> WorldRun::create(const v1::LoadWorld& load, NodeId self, int threads,
                                                           const MakeEngine& make_engine, Send send) {
  std::unique_ptr<WorldRun> run(new WorldRun());
  run->world_ = load.world();
  run->send_ = std::move(send);
  for (const std::uint64_t node : load.nodes()) run->nodes_.push_back(NodeId{node});
  const auto place = std::find(run->nodes_.begin(), run->nodes_.end(), self);
  if (place == run->nodes_.end()) return absl::InvalidArgumentError("the world's list of servers lacks this one");
  run->self_ = static_cast<Rank>(place - run->nodes_.begin());

  absl::StatusOr<WorldSettings> settings = from_proto(load.settings());
  if (!settings.ok()) return settings.status();
  absl::StatusOr<std::unique_ptr<Engine>> engine = make_engine(engine_settings(*settings));
  if (!engine.ok()) return engine.status();
  run->engine_ = std::move(*engine);

  std::vector<SectorIndex> splitters;
  for (const v1::SectorIndex& splitter : load.splitters()) splitters.push_back(from_proto(splitter));
  if (splitters.size() + 1 != run->nodes_.size()) {
    return absl::InvalidArgumentError("the sector map does not have one run per server");
  }
  const SectorIndex anchor = from_proto(load.anchor());
  Share::Options options;
  options.settings = *settings;
  options.anchor = anchor;
  options.map = SectorMap(anchor, std::move(splitters), load.map_epoch());
  options.self = run->self_;
  options.parallel = parallel_on(threads);
  run->share_ = std::make_unique<Share>(std::move(options), *run->engine_);
  if (absl::Status status = run->add_shapes(load.shapes()); !status.ok()) return status;
  absl::StatusOr<std::vector<BodyRecord>> records = unpack_records(load.records());
  if (!records.ok()) return records.status();
  for (const BodyRecord& record : *records) run->share_->add_body(record);
  run->share_->expect_radius(load.radius_max());
  return run;
}

absl::Status WorldRun::add_shapes(const google::protobuf::RepeatedPtrField<v1::Shape>& shapes) {
  for (const v1::Shape& message : shapes) {
    absl::StatusOr<Shape> shape = from_proto(message);
    if (!shape.ok()) return shape.status();
    share_->add_shape(next_shape_++, *shape);
  }
  return absl::OkStatus();
}

void WorldRun::take(v1::Grant grant) {
  const std::uint64_t serial = grant.serial();
  grants_.insert_or_assign(serial, std::move(grant));
}

WorldRun::Inbox& WorldRun::inbox(Tick tick, Kind kind) {
  Inbox& box = inboxes_[{tick, kind}];
  box.from.resize(nodes_.size());
  return box;
}

absl::Status WorldRun::take(NodeId from, v1::Round round) {
  const auto place = std::find(nodes_.begin(), nodes_.end(), from);
  if (place == nodes_.end()) return absl::InvalidArgumentError(absl::StrCat("a round from ", from.value, ", which is no server of this world"));
  if (round.tick() <= tick_ || round.tick() > tick_ + 2) {
    return absl::InternalError(absl::StrCat("a message of tick ", round.tick(), " arrived after tick ", tick_));
  }
  Inbox& box = inbox(round.tick(), round.kind());
  std::optional<std::string>& slot = box.from[place - nodes_.begin()];
  if (slot) return absl::InternalError(absl::StrCat("a message of tick ", round.tick(), " arrived twice"));
  slot = std::move(*round.mutable_body());
  ++box.count;
  return absl::OkStatus();
}

// Whether every wanted peer (all of them where `wanted` is null) has sent its message of the tick under way.
bool WorldRun::has_all(Kind kind, const std::vector<bool>* wanted) const {
  const auto box = inboxes_.find({tick_ + 1, kind});
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_ || (wanted != nullptr && !(*wanted)[rank])) continue;
    if (box == inboxes_.end() || !box->second.from[rank]) return false;
  }
  return true;
}

bool WorldRun::ready() const {
  switch (phase_) {
    case Phase::kIdle:
      return grant_.has_value() || grants_.contains(next_serial_);
    case Phase::kAwaitsExchange:
      return has_all(v1::Round::EXCHANGE, nullptr);
    case Phase::kAwaitsSeams:
      return has_all(v1::Round::SEAMS, nullptr);
    case Phase::kAwaitsShipment:
      return has_all(v1::Round::SHIPMENT, &share_->awaits_shipment_from());
    case Phase::kAwaitsSolution:
      return has_all(v1::Round::SOLUTION, &share_->awaits_solution_from());
  }
  return false;
}

absl::Status WorldRun::proceed(const std::function<Nanoseconds()>& clock) {
  switch (phase_) {
    case Phase::kIdle:
      return next_grant_or_tick(clock());
    case Phase::kAwaitsExchange:
      return on_exchange();
    case Phase::kAwaitsSeams:
      return on_seams();
    case Phase::kAwaitsShipment:
      return on_shipments();
    case Phase::kAwaitsSolution:
      return on_solutions(clock());
  }
  return absl::OkStatus();
}

void WorldRun::send_round(Rank to, Kind kind, std::string body) {
  exchange_bytes_ += body.size();
  v1::ClusterMessage message;
  v1::Round& round = *message.mutable_round();
  round.set_world(world_);
  round.set_tick(tick_ + 1);
  round.set_kind(kind);
  round.set_body(std::move(body));
  send_(nodes_[to], message);
}

absl::Status WorldRun::next_grant_or_tick(Nanoseconds now) {
  if (!grant_) {
    const auto next = grants_.find(next_serial_);
    grant_ = std::move(next->second);
    grants_.erase(next);
    ++next_serial_;
    ticks_left_ = grant_->ticks();
    if (absl::Status status = add_shapes(grant_->new_shapes()); !status.ok()) return status;
  }
  if (ticks_left_ > 0) {
    tick_began_ = now;
    return begin_tick();
  }
  for (const v1::Query& query : grant_->queries()) answer(query);
  grant_.reset();
  return absl::OkStatus();
}

absl::Status WorldRun::begin_tick() {
  std::vector<Command> commands;
  if (ticks_left_ == grant_->ticks()) {
    absl::StatusOr<std::vector<Command>> granted = unpack_commands(grant_->commands());
    if (!granted.ok()) return granted.status();
    commands = std::move(*granted);
  }
  --ticks_left_;
  std::vector<Exchange> outbox = share_->begin_tick(commands);
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_) {
      own_exchange_ = std::move(outbox[rank]);
    } else {
      send_round(rank, v1::Round::EXCHANGE, pack(outbox[rank]));
    }
  }
  phase_ = Phase::kAwaitsExchange;
  return absl::OkStatus();
}

absl::Status WorldRun::on_exchange() {
  std::vector<Exchange> messages(nodes_.size());
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_) {
      messages[rank] = std::move(own_exchange_);
      continue;
    }
    absl::StatusOr<Exchange> message = unpack_exchange(*inbox(tick_ + 1, v1::Round::EXCHANGE).from[rank]);
    if (!message.ok()) return message.status();
    messages[rank] = std::move(*message);
  }
  own_seams_ = share_->detect(std::move(messages));
  if (nodes_.size() > 1) {
    const std::string packed = pack(own_seams_);
    for (Rank rank = 0; rank < nodes_.size(); ++rank) {
      if (rank != self_) send_round(rank, v1::Round::SEAMS, packed);
    }
  }
  phase_ = Phase::kAwaitsSeams;
  return absl::OkStatus();
}

absl::Status WorldRun::on_seams() {
  std::vector<Seams> received(nodes_.size());
  std::vector<const Seams*> messages(nodes_.size());
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    messages[rank] = rank == self_ ? &own_seams_ : &received[rank];
    if (rank == self_) continue;
    absl::StatusOr<Seams> message = unpack_seams(*inbox(tick_ + 1, v1::Round::SEAMS).from[rank]);
    if (!message.ok()) return message.status();
    received[rank] = std::move(*message);
  }
  std::vector<Shipment> outbox = share_->join(messages);
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_) {
      own_shipment_ = std::move(outbox[rank]);
    } else if (!outbox[rank].islands.empty()) {
      send_round(rank, v1::Round::SHIPMENT, pack(outbox[rank]));
    }
  }
  phase_ = Phase::kAwaitsShipment;
  return absl::OkStatus();
}

absl::Status WorldRun::on_shipments() {
  std::vector<Shipment> messages(nodes_.size());
  const std::vector<bool> shipped = share_->awaits_shipment_from();
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_) {
      messages[rank] = std::move(own_shipment_);
    } else if (shipped[rank]) {
      absl::StatusOr<Shipment> message = unpack_shipment(*inbox(tick_ + 1, v1::Round::SHIPMENT).from[rank]);
      if (!message.ok()) return message.status();
      messages[rank] = std::move(*message);
    }
  }
  std::vector<Solution> outbox = share_->solve(std::move(messages));
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_) {
      own_solution_ = std::move(outbox[rank]);
    } else if (shipped[rank]) {
      send_round(rank, v1::Round::SOLUTION, pack(outbox[rank]));
    }
  }
  phase_ = Phase::kAwaitsSolution;
  return absl::OkStatus();
}

absl::Status WorldRun::on_solutions(Nanoseconds now) {
  std::vector<Solution> messages(nodes_.size());
  for (Rank rank = 0; rank < nodes_.size(); ++rank) {
    if (rank == self_) {
      messages[rank] = std::move(own_solution_);
    } else if (share_->awaits_solution_from()[rank]) {
      absl::StatusOr<Solution> message = unpack_solution(*inbox(tick_ + 1, v1::Round::SOLUTION).from[rank]);
      if (!message.ok()) return message.status();
      messages[rank] = std::move(*message);
    }
  }
  share_->finish(std::move(messages));
  ++tick_;
  inboxes_.erase(inboxes_.begin(), inboxes_.lower_bound({tick_ + 1, 0}));
  phase_ = Phase::kIdle;
  tick_done_ = true;

  const TickCounts& counts = share_->counts();
  v1::TickReport& report = reports_.emplace_back();
  report.set_tick(tick_);
  report.set_work_us(
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(now - tick_began_).count()));
  report.set_clones(counts.clones);
  report.set_contacts(counts.contacts);
  report.set_islands_across_seams(counts.islands_across_seams);
  report.set_islands_shipped(counts.islands_shipped);
  report.set_bodies_awake(counts.bodies_awake);
  report.set_sectors(counts.sectors);
  report.set_sectors_awake(counts.sectors_awake);
  report.set_bodies_stopped(counts.bodies_stopped);
  return absl::OkStatus();
}

bool WorldRun::report_due() const {
  const bool idle = phase_ == Phase::kIdle && !grant_ && !grants_.contains(next_serial_);
  return reports_.size() >= kTicksPerReport || (idle && !reports_.empty());
}

void WorldRun::answer(const v1::Query& query) {
  v1::ClusterMessage message;
  v1::Answer& answer = *message.mutable_answer();
  answer.set_world(world_);
  answer.set_query(query.id());
  answer.set_tick(tick_);
  if (query.has_hash()) {
    const WorldHash hash = share_->hash();
    answer.set_hash_low(hash.low());
    answer.set_hash_high(hash.high());
  } else if (query.has_ray()) {
    const v1::RayQuery& ray = query.ray();
    const std::optional<Share::RayAnswer> hit = share_->raycast(
        from_proto(ray.origin()), from_proto(ray.direction()), ray.length(), ray.mask());
    answer.set_hit(hit.has_value());
    if (hit) {
      answer.set_body(hit->body.value);
      answer.set_distance(hit->distance);
      *answer.mutable_normal() = to_proto(hit->normal);
    }
  }
  send_(kCoordinatorNode, message);
}

}  // namespace tessera
