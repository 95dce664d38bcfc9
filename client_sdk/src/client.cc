#include "tessera/client.h"

#include <absl/strings/str_cat.h>

#include <string>

#include "client_sdk/src/body_subscriptions.h"
#include "client_sdk/src/client_impl.h"
#include "client_sdk/src/joint_stream.h"
#include "client_sdk/src/stream_traits.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"
#include "tessera.grpc.pb.h"

namespace tessera {
namespace {

constexpr std::uint64_t kBodiesAsked = 100'000;  // per request, also of joints: the coordinator's maximum

v1::Region to_proto(const WatchedRegion& region) {
  v1::Region message;
  *message.mutable_centre() = to_proto(region.centre);
  *message.mutable_half_size() = tessera::to_proto(region.half_size);
  return message;
}

ServerStatus read(const v1::ServerStatus& status) {
  ServerStatus server;
  server.node = status.node();
  server.stream_address = status.stream_address();
  server.precision = status.precision() == v1::PRECISION_FLOAT64 ? Precision::kFloat64 : Precision::kFloat32;
  server.threads = status.threads();
  server.capacity = status.capacity();
  server.labels.assign(status.labels().begin(), status.labels().end());
  server.tick = status.tick();
  server.bodies = status.bodies();
  server.counts = counts_from(status.counts());
  server.peak_rss_bytes = status.peak_rss_bytes();
  server.tick_ms = times_from(status.tick_ms());
  server.exchange_bytes = status.exchange_bytes();
  server.exchange_messages = status.exchange_messages();
  server.takes_part = status.takes_part();
  server.suspect = status.suspect();
  server.drained = status.drained();
  server.own_ms = status.own_ms();
  server.slow = status.slow();
  server.ground = {status.ground().tiles(), status.ground().bytes(), status.ground().waits(),
                   status.ground().ticks_waited()};
  return server;
}

absl::StatusOr<ClusterStatus> read(const v1::StatusReply& reply) {
  ClusterStatus status;
  status.state = reply.state();
  status.world = reply.world();
  status.tick = reply.tick();
  status.time = reply.time();
  status.real_time_factor = reply.real_time_factor();
  status.bodies = reply.bodies();
  status.counts = counts_from(reply.counts());
  status.counts_since_load = counts_from(reply.counts_since_load());
  status.tick_ms = times_from(reply.tick_ms());
  status.map_epoch = reply.map_epoch();
  status.moved_sectors = reply.moved_sectors();
  status.moved_bodies = reply.moved_bodies();
  status.recoveries = reply.recoveries();
  status.joined_servers = reply.joined_servers();
  status.left_servers = reply.left_servers();
  status.cut_off_servers = reply.cut_off_servers();
  for (const v1::CutOff& server : reply.cut_off()) {
    status.cut_off.push_back({server.node(),
                              server.stream_address(),
                              {server.unheard_by().begin(), server.unheard_by().end()},
                              server.seconds(),
                              server.tick()});
  }
  status.checkpoint_tick = reply.checkpoint_tick();
  status.store_failure = reply.store_failure();
  for (const v1::LeftOut& each : reply.left_out())
    status.left_out.push_back({each.tick(), each.commands(), each.reason()});
  status.waits_for_store = reply.waits_for_store();
  for (const v1::ServerStatus& server : reply.servers()) status.servers.push_back(read(server));
  status.failure = reply.failure();
  status.coordinator_peak_rss_bytes = reply.coordinator_peak_rss_bytes();
  status.anchor = from_proto(reply.anchor());
  for (const v1::Divergence& divergence : reply.divergences()) {
    status.divergences.push_back({from_proto(divergence), divergence.body_name(), divergence.joint_name()});
  }
  if (reply.has_settings()) {
    absl::StatusOr<WorldSettings> settings = from_proto(reply.settings());
    if (!settings.ok()) return settings.status();
    status.settings = *std::move(settings);
  }
  return status;
}

}  // namespace

using Stub = v1::Tessera::Stub;

v1::Request Client::request_of(const Batch& batch) {
  v1::Request request = *batch.commands.request_;
  request.set_ticks(batch.ticks);
  *request.mutable_queries() = batch.queries.request_->queries();
  request.set_after(batch.after);
  request.set_owner(batch.owner);
  return request;
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

absl::StatusOr<std::unique_ptr<Client>> Client::connect(const std::string& address, absl::Duration timeout,
                                                        const std::filesystem::path& keys_folder) {
  absl::StatusOr<ClientKeys> keys = ClientKeys::read(keys_folder);
  if (!keys.ok()) return keys.status();
  absl::StatusOr<std::shared_ptr<Coordinators>> coordinators = Coordinators::connect(address, *keys, timeout);
  if (!coordinators.ok()) return coordinators.status();
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Impl>(*std::move(keys), *std::move(coordinators))));
}

absl::StatusOr<LoadSummary> Client::load(const WorldDescription& world, bool replace,
                                         absl::Duration timeout) {
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  request.set_replace(replace);
  const auto reply = impl_->call(&Stub::Load, request, timeout);
  if (!reply.ok()) return reply.status();
  return LoadSummary{reply->bodies(), reply->sectors(), reply->servers()};
}

absl::StatusOr<SnapshotSummary> Client::snapshot(const std::filesystem::path& file, absl::Duration timeout) {
  absl::StatusOr<WholeFile> out = WholeFile::create(file);
  if (!out.ok()) return out.status();
  absl::StatusOr<SnapshotSummary> summary = impl_->snapshot(*out, timeout);
  if (!summary.ok()) return summary;
  if (absl::Status status = out->finish(); !status.ok()) return status;
  return summary;
}

absl::StatusOr<LoadSummary> Client::restore(const std::filesystem::path& file, bool replace,
                                            absl::Duration timeout) {
  const absl::StatusOr<v1::LoadReply> reply = impl_->restore(file, replace, timeout);
  if (!reply.ok()) return reply.status();
  return LoadSummary{reply->bodies(), reply->sectors(), reply->servers()};
}

absl::Status Client::unload(absl::Duration timeout) {
  return impl_->call(&Stub::Unload, v1::UnloadRequest(), timeout).status();
}

absl::StatusOr<Answers> Client::run(const Batch& batch, absl::Duration timeout) {
  return impl_->run(request_of(batch), timeout, /*sees_own=*/false);
}

void Client::send(const Batch& batch, std::function<void(absl::StatusOr<Answers>)> done) {
  impl_->send(request_of(batch), std::move(done));
}

absl::StatusOr<Applied> Client::apply(const CommandList& commands, absl::Duration timeout) {
  const absl::StatusOr<Answers> answers = impl_->run(*commands.request_, timeout, /*sees_own=*/false);
  if (!answers.ok()) return answers.status();
  return answers->applied();
}

absl::StatusOr<Answers> Client::ask(const QueryList& queries, absl::Duration timeout) {
  return impl_->run(*queries.request_, timeout, /*sees_own=*/true);
}

absl::StatusOr<Spawned> Client::spawn(const NewBody& body, absl::Duration timeout) {
  const absl::StatusOr<Applied> applied = apply(CommandList().spawn(body), timeout);
  if (!applied.ok()) return applied.status();
  return Spawned{applied->created.front().first_body, applied->tick};
}

absl::StatusOr<AddedJoint> Client::add_joint(const NewJoint& joint, absl::Duration timeout) {
  const absl::StatusOr<Applied> applied = apply(CommandList().add_joint(joint), timeout);
  if (!applied.ok()) return applied.status();
  return AddedJoint{applied->created.front().first_joint, applied->tick};
}

absl::StatusOr<Tick> Client::pause(absl::Duration timeout) {
  return impl_->tick_of(&Stub::Pause, v1::PauseRequest(), timeout);
}

absl::StatusOr<Tick> Client::resume(double real_time_factor, absl::Duration timeout) {
  v1::ResumeRequest request;
  request.set_real_time_factor(real_time_factor);
  return impl_->tick_of(&Stub::Resume, request, timeout);
}

absl::StatusOr<Tick> Client::step(std::uint64_t ticks, absl::Duration timeout) {
  Batch batch;
  batch.ticks = ticks;
  const absl::StatusOr<Answers> answers = run(batch, timeout);
  if (!answers.ok()) return answers.status();
  return answers->tick();
}

absl::StatusOr<ClusterStatus> Client::status(absl::Duration timeout) {
  const auto reply = impl_->call(&Stub::GetStatus, v1::StatusRequest(), timeout);
  if (!reply.ok()) return reply.status();
  return read(*reply);
}

absl::StatusOr<HashAt> Client::hash(absl::Duration timeout) {
  QueryList queries;
  const auto hash = queries.hash();
  const absl::StatusOr<Answers> answers = ask(queries, timeout);
  if (!answers.ok()) return answers.status();
  return HashAt{answers->tick(), (*answers)[hash], answers->program_hash(hash)};
}

absl::StatusOr<std::vector<Neighbour>> Client::near(const NearQuery& query, absl::Duration timeout) {
  QueryList queries;
  const auto near = queries.near(query);
  const absl::StatusOr<Answers> answers = ask(queries, timeout);
  if (!answers.ok()) return answers.status();
  return (*answers)[near];
}

absl::StatusOr<std::optional<RayResult>> Client::raycast(const RayQuery& ray, absl::Duration timeout) {
  QueryList queries;
  const auto first = queries.ray(ray);
  const absl::StatusOr<Answers> answers = ask(queries, timeout);
  if (!answers.ok()) return answers.status();
  std::vector<RayResult> hits = (*answers)[first];
  return hits.empty() ? std::nullopt : std::optional(std::move(hits.front()));
}

absl::StatusOr<FoundBody> Client::find(const std::string& name, absl::Duration timeout) {
  // Bodies with longer names may come first: ask for all with this prefix.
  absl::StatusOr<FoundBodies> found = find_bodies(name, kBodiesAsked, timeout);
  if (!found.ok()) return found.status();
  for (FoundBody& body : found->bodies) {
    if (body.name == name) return std::move(body);
  }
  return absl::NotFoundError(absl::StrCat("no body is called \"", name, "\""));
}

absl::StatusOr<FoundBodies> Client::find_bodies(const std::string& prefix, std::uint64_t limit,
                                                absl::Duration timeout) {
  BodyQuery query;
  query.prefix = prefix;
  query.limit = limit;
  return find_bodies(query, timeout);
}

absl::StatusOr<FoundBodies> Client::find_bodies(const BodyQuery& query, absl::Duration timeout) {
  QueryList queries;
  const auto found = queries.find_bodies(query);
  const absl::StatusOr<Answers> answers = ask(queries, timeout);
  if (!answers.ok()) return answers.status();
  return (*answers)[found];
}

absl::StatusOr<FoundJoints> Client::find_joints(const std::string& prefix, std::uint64_t limit,
                                                absl::Duration timeout) {
  QueryList queries;
  const auto found = queries.find_joints(prefix, limit);
  const absl::StatusOr<Answers> answers = ask(queries, timeout);
  if (!answers.ok()) return answers.status();
  return (*answers)[found];
}

absl::StatusOr<FoundJoint> Client::find_joint(const std::string& name, absl::Duration timeout) {
  absl::StatusOr<FoundJoints> found = find_joints(name, kBodiesAsked, timeout);
  if (!found.ok()) return found.status();
  for (FoundJoint& joint : found->joints) {
    if (joint.joint.name == name) return std::move(joint);
  }
  return absl::NotFoundError(absl::StrCat("no joint is called \"", name, "\""));
}

absl::StatusOr<FoundFrames> Client::find_frames(const std::string& prefix, std::uint64_t limit,
                                                absl::Duration timeout) {
  QueryList queries;
  const auto found = queries.find_frames(prefix, limit);
  const absl::StatusOr<Answers> answers = ask(queries, timeout);
  if (!answers.ok()) return answers.status();
  return (*answers)[found];
}

absl::StatusOr<FoundFrame> Client::find_frame(const std::string& name, absl::Duration timeout) {
  // The name itself is the first of those that begin with it.
  absl::StatusOr<FoundFrames> found = find_frames(name, 1, timeout);
  if (!found.ok()) return found.status();
  if (!found->frames.empty() && found->frames.front().name == name) return std::move(found->frames.front());
  return absl::NotFoundError(absl::StrCat("no frame is called \"", name, "\""));
}

absl::StatusOr<std::unique_ptr<BodyStream>> Client::watch_bodies(const BodyFilter& filter,
                                                                 absl::Duration timeout) {
  if (!filter.follow) return subscribe(impl_->subscriber(), filter, timeout);
  const absl::StatusOr<ClusterStatus> now = status(timeout);
  if (!now.ok()) return now.status();
  if (!now->settings) return absl::FailedPreconditionError("no world is loaded: there is nothing to watch");
  return subscribe_following(impl_->subscriber(), filter, now->settings->sector_size, timeout);
}

absl::StatusOr<std::unique_ptr<ContactStream>> Client::watch_contacts(const ContactFilter& filter,
                                                                      absl::Duration timeout) {
  v1::WatchContactsRequest request;
  for (const BodyId& id : filter.ids) request.add_ids(id.value);
  request.set_persisting(filter.persisting);
  request.set_mask(filter.mask);
  request.set_impulse_min(filter.impulse_min);
  return impl_->subscriber().watch<ContactTraits>(request, timeout);
}

absl::StatusOr<std::unique_ptr<SeamStream>> Client::watch_seams(const SeamFilter& filter,
                                                                absl::Duration timeout) {
  v1::WatchSeamsRequest request;
  if (filter.region) *request.mutable_region() = to_proto(*filter.region);
  request.set_every_ticks(filter.every_ticks);
  return impl_->subscriber().watch<SeamTraits>(request, timeout);
}

absl::StatusOr<std::unique_ptr<DivergenceStream>> Client::watch_divergences(absl::Duration timeout) {
  return impl_->subscriber().watch<DivergenceTraits>(v1::WatchDivergencesRequest(), timeout);
}

absl::StatusOr<std::unique_ptr<ProgramStream>> Client::watch_programs(const ProgramFilter& filter,
                                                                      absl::Duration timeout) {
  v1::WatchProgramsRequest request;
  for (const BodyId& id : filter.ids) request.add_ids(id.value);
  request.set_kind(filter.kind);
  request.set_every_ticks(filter.every_ticks);
  return impl_->subscriber().watch<ProgramTraits>(request, timeout);
}

absl::StatusOr<std::unique_ptr<JointStream>> Client::watch_joints(const std::vector<FoundJoint>& joints,
                                                                  std::uint32_t every_ticks,
                                                                  absl::Duration timeout) {
  if (joints.empty()) return absl::InvalidArgumentError("joints: there must be at least one to watch");
  const absl::StatusOr<ClusterStatus> now = status(timeout);
  if (!now.ok()) return now.status();
  if (!now->settings) return absl::FailedPreconditionError("no world is loaded: there is nothing to watch");
  BodyFilter filter;
  filter.ids = bodies_of(joints);
  filter.every_ticks = every_ticks;
  filter.complete = true;
  absl::StatusOr<std::unique_ptr<BodyStream>> bodies = watch_bodies(filter, timeout);
  if (!bodies.ok()) return bodies.status();
  return std::make_unique<JointsOfBodies>(*std::move(bodies), joints, now->settings->sector_size);
}

absl::StatusOr<Tick> Client::drain(std::uint64_t node, absl::Duration timeout) {
  v1::DrainRequest request;
  request.set_node(node);
  return impl_->tick_of(&Stub::Drain, request, timeout);
}

absl::StatusOr<Balance> Client::balance(bool dry_run, const std::string& policy, absl::Duration timeout) {
  v1::BalanceRequest request;
  request.set_dry_run(dry_run);
  request.set_policy(policy);
  const auto reply = impl_->call(&Stub::Balance, request, timeout);
  if (!reply.ok()) return reply.status();
  Balance balance{.tick = reply->tick(),
                  .shares = {},
                  .moved_sectors = reply->moved_sectors(),
                  .moved_bodies = reply->moved_bodies(),
                  .moves = reply->moves()};
  for (const v1::BalanceReply::ServerShare& share : reply->shares()) {
    balance.shares.push_back({share.node(), share.tick_us() / 1000, share.tick_us_then() / 1000});
  }
  return balance;
}

absl::Status Client::shutdown(absl::Duration timeout) {
  return impl_->call(&Stub::Shutdown, v1::ShutdownRequest(), timeout).status();
}

}  // namespace tessera
