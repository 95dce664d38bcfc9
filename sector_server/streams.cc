#include "sector_server/streams.h"

#include <absl/strings/str_cat.h>
#include <time.h>

#include <algorithm>
#include <chrono>

#include "lpss/observe/seams.h"
#include "lpss/observe/state.h"
#include "lpss/tick/events.h"
#include "proto/convert.h"
#include "proto/status.h"
#include "proto/stream_limits.h"
#include "sector_server/contact_message.h"
#include "sector_server/watched_box.h"
#include "sector_server/watched_contacts.h"

namespace tessera {
namespace {

// How often a waiting stream checks whether its client is still connected.
constexpr std::chrono::milliseconds kPatience(200);

// How long a stream waits for a client that has it at other servers.
constexpr std::chrono::seconds kUnclaimedMax(10);

// How long a client that fell behind has to take its last batch, and the reason why there are no more.
constexpr std::chrono::seconds kFarewellMax(30);

// That this thread has had on a processor.
std::chrono::nanoseconds thread_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

std::size_t bytes_of(const google::protobuf::Message& batch) { return batch.SpaceUsedLong(); }

v1::WatchBodiesRequest* request_in(v1::Subscription& of, const v1::WatchBodiesRequest&) {
  return of.mutable_bodies();
}
v1::WatchContactsRequest* request_in(v1::Subscription& of, const v1::WatchContactsRequest&) {
  return of.mutable_contacts();
}
v1::WatchSeamsRequest* request_in(v1::Subscription& of, const v1::WatchSeamsRequest&) {
  return of.mutable_seams();
}
v1::WatchDivergencesRequest* request_in(v1::Subscription& of, const v1::WatchDivergencesRequest&) {
  return of.mutable_divergences();
}

v1::WatchProgramsRequest* request_in(v1::Subscription& of, const v1::WatchProgramsRequest&) {
  return of.mutable_programs();
}

WorldPosition position_of(const BodyRecord& record) {
  return {record.home, Eigen::Vector3d(record.state.position.data())};
}

v1::Contact::Phase phase_of(ContactPhase phase) {
  switch (phase) {
    case ContactPhase::kBegin:
      return v1::Contact::BEGIN;
    case ContactPhase::kPersist:
      return v1::Contact::PERSIST;
    case ContactPhase::kEnd:
      return v1::Contact::END;
  }
  return v1::Contact::BEGIN;
}

template <typename Request>
int watched_ids_of(const Request& request) {
  if constexpr (requires { request.ids_size(); }) return request.ids_size();
  return 0;
}

Told told_by(bool new_only) { return new_only ? Told::kBetweenTicks : Told::kTicks; }

template <typename Request>
absl::Status check_ids(const Request& request) {
  if (request.ids_size() <= kWatchedIdsMax) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("ids: ", request.ids_size(), " must be at most ", kWatchedIdsMax));
}

}  // namespace

template <typename Batch>
Batch Streams::batch_of(Tick tick, bool is_first) const {
  Batch batch;
  batch.set_tick(tick);
  batch.set_node(node_.value);
  *batch.mutable_source() = source_;
  batch.mutable_source()->set_first(is_first);
  return batch;
}

v1::ContactBatch Streams::contacts_for(const v1::WatchContactsRequest& request, Tick tick,
                                       const TickMachine& machine) const {
  auto batch = batch_of<v1::ContactBatch>(tick);
  const WatchedContacts watched(request);
  for (const ContactEvent* found : watched.among(machine.contact_events(), machine.partition())) {
    const ContactEvent& event = *found;
    v1::Contact& contact = *batch.add_contacts();
    if (event.phase == ContactPhase::kEnd || event.trigger) {
      contact.set_a(event.a.value);
      contact.set_b(event.b.value);
      contact.set_trigger(event.trigger);
    } else {
      contact = to_proto(event.a, event.b, event);
    }
    contact.set_phase(phase_of(event.phase));
  }
  return batch;
}

v1::SeamBatch Streams::seams_for(const v1::WatchSeamsRequest& request, Tick tick,
                                 const Partition& partition) const {
  auto batch = batch_of<v1::SeamBatch>(tick);
  const WatchedBox box(request, partition.sector_size());
  for (const CloneAt& clone : clones_of(partition)) {
    if (!box.holds(clone.position)) continue;
    v1::SeamBatch::Clone& added = *batch.add_clones();
    added.set_body(clone.body.value);
    *added.mutable_sector() = to_proto(clone.position.sector);
  }
  for (const IslandHere& island : islands_across_seams(partition)) {
    v1::SeamBatch::Island added;
    added.set_id(island.id.value);
    for (const BodyId id : island.bodies) {
      if (box.holds(position_of(*body_of(partition, id)))) added.add_bodies(id.value);
    }
    if (added.bodies_size() > 0) *batch.add_islands() = std::move(added);
  }
  return batch;
}

v1::DivergenceBatch Streams::divergences_in(Tick tick, const std::vector<Divergence>& divergences) const {
  auto batch = batch_of<v1::DivergenceBatch>(tick);
  for (const Divergence& divergence : first_divergences(divergences))
    *batch.add_divergences() = to_proto(divergence);
  return batch;
}

template <typename Visit>
void Streams::for_each_list(const Visit& visit) {
  visit(bodies_);
  visit(contacts_);
  visit(seams_);
  visit(divergences_);
  visit(programs_);
}

template <typename S, typename Request>
void Streams::expect(List<S>& list, const Request& request) {
  const auto is_it = [&](const std::shared_ptr<S>& known) {
    return known->request().subscription() == request.subscription() && known->is_open();
  };
  if (std::any_of(list.begin(), list.end(), is_it)) return;
  list.push_back(std::make_shared<S>(request));
  list.back()->unclaimed_since = std::chrono::steady_clock::now();
}

void Streams::expect(const v1::Subscription& subscription) {
  using Kind = v1::Subscription::RequestCase;
  switch (subscription.request_case()) {
    case Kind::kBodies:
      return expect(bodies_, subscription.bodies());
    case Kind::kContacts:
      return expect(contacts_, subscription.contacts());
    case Kind::kSeams:
      return expect(seams_, subscription.seams());
    case Kind::kDivergences:
      return expect(divergences_, subscription.divergences());
    case Kind::kPrograms:
      return expect(programs_, subscription.programs());
    case Kind::REQUEST_NOT_SET:
      return;
  }
}

void Streams::begin_world(const v1::LoadWorld& load) {
  const std::lock_guard lock(mutex_);
  if (load.has_guest()) close_all();
  const bool goes_on = source_.load() == load.load();
  source_.set_load(load.load());
  source_.set_epoch(load.world());
  source_.set_servers(static_cast<std::uint32_t>(load.nodes_size()));
  source_.set_since(0);
  for (const auto& contacts : contacts_) contacts->told_of_world = Told::kNothing;
  for (const auto& divergences : divergences_) divergences->told_of_world = Told::kNothing;
  for (const auto& bodies : bodies_) bodies->forget();
  for (const auto& programs : programs_) programs->forget();
  if (!goes_on) {
    for (const auto& bodies : bodies_) bodies->told_of_world = Told::kNothing;
    for (const auto& seams : seams_) seams->told_of_world = Told::kNothing;
    for (const auto& programs : programs_) programs->told_of_world = Told::kNothing;
  }
  for (const v1::Subscription& subscription : load.subscriptions()) expect(subscription);
  changed_ = true;
}

void Streams::change_servers(const NewServers& servers) {
  const std::lock_guard lock(mutex_);
  source_.set_servers(static_cast<std::uint32_t>(servers.servers));
  source_.set_since(servers.since);
  for_each_list([](const auto& list) {
    for (const auto& subscription : list) {
      if (subscription->told_of_world != Told::kBetweenTicks) continue;
      subscription->told_of_world = Told::kOutdated;
      if constexpr (requires { subscription->forget(); }) subscription->forget();
    }
  });
  for (const v1::Subscription& subscription : servers.subscriptions) expect(subscription);
  changed_ = true;
}

void Streams::end_world() {
  const std::lock_guard lock(mutex_);
  close_all();
}

void Streams::close_all() {
  for_each_list([](auto& list) {
    std::erase_if(list, [](const auto& subscription) { return subscription->unclaimed_since.has_value(); });
    for (const auto& subscription : list) subscription->close();
  });
}

void Streams::drop_unclaimed() {
  const auto oldest = std::chrono::steady_clock::now() - kUnclaimedMax;
  for_each_list([&](auto& list) {
    const std::size_t dropped = std::erase_if(list, [&](const auto& subscription) {
      return subscription->unclaimed_since && *subscription->unclaimed_since < oldest;
    });
    changed_ = changed_ || dropped > 0;
  });
}

// Clients that take nothing must not cost the others their streams, or the world its memory.
void Streams::keep_limits() {
  const auto now = std::chrono::steady_clock::now();
  std::size_t bytes = 0;
  for_each_list([&](const auto& list) {
    for (const auto& subscription : list) {
      const auto since = subscription->overrun_since();
      if (!since) bytes += subscription->bytes();
      const bool takes_nothing = since ? now - *since >= kFarewellMax : subscription->is_stuck(now);
      if (takes_nothing && subscription->cancel) subscription->cancel();
    }
  });
  while (bytes > kAllStreamsBytesMax) {
    std::size_t most = 0;
    std::function<void()> drop_fullest;
    for_each_list([&](const auto& list) {
      for (const auto& subscription : list) {
        if (subscription->overrun_since() || subscription->bytes() <= most) continue;
        most = subscription->bytes();
        // What is on its way to the client is freed only with the call.
        drop_fullest = [subscription, now] {
          subscription->drop(now);
          if (subscription->bytes() > 0 && subscription->cancel) subscription->cancel();
        };
      }
    });
    if (!drop_fullest) return;
    drop_fullest();
    bytes -= std::min(bytes, most);
  }
}

std::optional<v1::Subscriptions> Streams::changed_subscriptions() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(changed_, false)) return std::nullopt;
  v1::Subscriptions subscriptions;
  for_each_list([&](const auto& list) {
    for (const auto& known : list) {
      if (known->request().subscription() == 0 || !known->is_open()) continue;
      *request_in(*subscriptions.add_all(), known->request()) = known->request();
    }
  });
  return subscriptions;
}

// Whether a subscription of states is to get those of a tick.
template <typename S>
bool Streams::is_wanted(const S& subscription, Tick tick, bool new_only) {
  const std::uint64_t every =
      std::max<std::uint64_t>(subscription.request().every_ticks(), 1) * subscription.thinning();
  return new_only ? subscription.is_new() : tick % every == 0;
}

void Streams::publish_bodies(Tick tick, Partition& partition, bool new_only) {
  if (bodies_.empty()) return body_changes_.forget();
  const auto is_new = [](const auto& subscription) { return subscription->is_new(); };
  if (new_only && std::none_of(bodies_.begin(), bodies_.end(), is_new)) return;
  const std::chrono::nanoseconds start = thread_time();
  body_changes_.look(partition);
  bool has_time = true;
  auto next = bodies_.begin();
  for (std::size_t left = bodies_.size(); left > 0; --left) {
    const auto here = next++;
    Bodies& subscription = **here;
    if (!is_wanted(subscription, tick, new_only)) continue;
    if (!has_time) {
      if (!new_only) subscription.leave_out();
      continue;
    }
    subscription.told_of_world = told_by(new_only);
    publish_bodies(tick, partition, subscription);
    bodies_.splice(bodies_.end(), bodies_, here);  // others come first the next time
    has_time = thread_time() - start < kPublishMax;
  }
  std::uint64_t all_told = body_changes_.looks();
  for (const std::shared_ptr<Bodies>& subscription : bodies_)
    all_told = std::min(all_told, subscription->told.until().value_or(all_told));
  body_changes_.drop_until(all_told);
  if (new_only && !has_time) wake_();
}

void Streams::publish_bodies(Tick tick, const Partition& partition, Bodies& subscription) {
  const auto now = std::chrono::steady_clock::now();
  StreamBudget& budget = subscription.budget;
  BodySnapshot news =
      subscription.told.news(partition, body_changes_, subscription.spare(), budget.bodies(now));
  news.tick = tick;
  news.source = source_;
  const std::size_t bytes = bytes_of(news);
  if (!subscription.admit_state(bytes, now)) return;
  subscription.told.told(news);
  news.reserved = budget.reserve(news.bodies.size());
  subscription.push(std::move(news), bytes);
}

void Streams::publish_programs(Tick tick, const Partition& partition, bool new_only) {
  if (programs_.empty()) return program_changes_.forget();
  const auto is_new = [](const auto& subscription) { return subscription->is_new(); };
  if (new_only && std::none_of(programs_.begin(), programs_.end(), is_new)) return;
  program_changes_.look(partition);
  for (const std::shared_ptr<Programs>& subscription : programs_) {
    if (!is_wanted(*subscription, tick, new_only)) continue;
    auto batch = batch_of<v1::ProgramBatch>(tick);
    program_changes_.for_each_since(partition, subscription->told_until, [&](const ProgramsView& of) {
      subscription->watched.add_those_of(of, batch);
    });
    subscription->told_of_world = told_by(new_only);
    const auto now = std::chrono::steady_clock::now();
    const std::size_t bytes = bytes_of(batch);
    if (!subscription->admit_state(bytes, now)) continue;
    subscription->told_until = program_changes_.looks();
    subscription->push(std::move(batch), bytes);
  }
}

void Streams::publish(Tick tick, TickMachine& machine, bool new_only) {
  const Partition& partition = machine.partition();
  const std::lock_guard lock(mutex_);
  drop_unclaimed();
  publish_bodies(tick, machine.partition(), new_only);
  publish_programs(tick, partition, new_only);
  for (const std::shared_ptr<Seams>& subscription : seams_) {
    if (!is_wanted(*subscription, tick, new_only)) continue;
    subscription->told_of_world = told_by(new_only);
    auto batch = seams_for(subscription->request(), tick, partition);
    const std::size_t bytes = bytes_of(batch);
    subscription->push_state(std::move(batch), bytes, std::chrono::steady_clock::now());
  }
  for (const std::shared_ptr<Contacts>& subscription : contacts_) {
    // The first batch only states the tick from which on the stream is complete.
    const bool counts = subscription->told_of_world != Told::kNothing && !new_only;
    if (!counts && !subscription->is_new()) continue;
    auto batch = counts ? contacts_for(subscription->request(), tick, machine)
                        : batch_of<v1::ContactBatch>(tick, /*is_first=*/true);
    const std::size_t bytes = bytes_of(batch);
    subscription->push(std::move(batch), bytes);
    subscription->told_of_world = told_by(new_only);
  }
  // Likewise.
  for (const std::shared_ptr<Divergences>& subscription : divergences_) {
    const bool counts = subscription->told_of_world != Told::kNothing && !new_only;
    if (!counts && !subscription->is_new()) continue;
    auto batch = counts ? divergences_in(tick, machine.divergences())
                        : batch_of<v1::DivergenceBatch>(tick, /*is_first=*/true);
    const std::size_t bytes = bytes_of(batch);
    subscription->push(std::move(batch), bytes);
    subscription->told_of_world = told_by(new_only);
  }
  keep_limits();
  report_contacts(machine.partition(), !contacts_.empty());
}

// The stream that waits for this client, or else a new one.
template <typename S, typename Request>
absl::StatusOr<std::shared_ptr<S>> Streams::claim(List<S>& list, const Request& request,
                                                  std::function<void()> cancel) {
  const std::lock_guard lock(mutex_);
  if (closing_) return absl::UnavailableError("the server is shutting down");
  for (const std::shared_ptr<S>& known : list) {
    if (!known->unclaimed_since || known->request().subscription() != request.subscription()) continue;
    known->unclaimed_since.reset();
    known->cancel = std::move(cancel);
    return known;
  }
  std::size_t streams = 0;
  for_each_list([&](const auto& other) { streams += other.size(); });
  if (streams >= kStreamsMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the server has ", streams, " streams already, which is the maximum"));
  }
  std::int64_t ids = watched_ids_of(request);
  for_each_list([&](const auto& other) {
    for (const auto& known : other) ids += watched_ids_of(known->request());
  });
  if (watched_ids_of(request) > 0 && ids > kAllWatchedIdsMax) {
    return absl::ResourceExhaustedError(absl::StrCat("ids: with these ", watched_ids_of(request),
                                                     ", the streams of the server would have more than ",
                                                     kAllWatchedIdsMax));
  }
  changed_ = true;
  const std::shared_ptr<S>& added = list.emplace_back(std::make_shared<S>(request));
  added->cancel = std::move(cancel);
  return added;
}

template <typename S, typename Request, typename Send>
grpc::Status Streams::serve(List<S>& list, grpc::ServerContext* context, const Request& request,
                            const Send& send) {
  absl::StatusOr<std::shared_ptr<S>> claimed = claim(list, request, [context] { context->TryCancel(); });
  if (!claimed.ok()) return to_grpc(claimed.status());
  const std::shared_ptr<S> subscription = *std::move(claimed);
  wake_();
  while (subscription->alive() && !context->IsCancelled()) {
    auto batch = subscription->next(kPatience);
    if (!batch) continue;
    if (!send(*subscription, *batch)) break;
    subscription->take_back(*std::move(batch));
  }
  bool closing = false;
  {
    const std::lock_guard lock(mutex_);
    subscription->cancel = nullptr;
    list.remove(subscription);
    changed_ = true;
    closing = closing_;
  }
  wake_();
  if (subscription->overrun_since()) {
    return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "the client fell too far behind the stream");
  }
  return closing ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the server is shutting down")
                 : grpc::Status::OK;
}

grpc::Status Streams::WatchBodies(grpc::ServerContext* context, const v1::WatchBodiesRequest* request,
                                  grpc::ServerWriter<v1::BodyBatch>* writer) {
  if (const auto precision = precision_of(*request); !precision.ok()) return to_grpc(precision.status());
  if (absl::Status status = check_ids(*request); !status.ok()) return to_grpc(status);
  if (absl::Status status = check_budget(*request); !status.ok()) return to_grpc(status);
  BodyBatches batches(*request);
  v1::BodyBatch batch;  // reused for all batches, with its memory, unless they are large
  return serve(bodies_, context, *request, [&](Bodies& subscription, const BodySnapshot& snapshot) {
    batches.write(snapshot, node_, batch);
    const std::size_t bytes = batch.ByteSizeLong();
    subscription.budget.sent(snapshot.reserved, bytes, snapshot.bodies.size());
    const bool goes_on = writer->Write(batch);
    if (bytes > kKeptBytesMax) batch = v1::BodyBatch();
    return goes_on;
  });
}

grpc::Status Streams::WatchContacts(grpc::ServerContext* context, const v1::WatchContactsRequest* request,
                                    grpc::ServerWriter<v1::ContactBatch>* writer) {
  if (absl::Status status = check_ids(*request); !status.ok()) return to_grpc(status);
  if (absl::Status status = check_contacts(*request); !status.ok()) return to_grpc(status);
  return serve(contacts_, context, *request,
               [&](const Contacts&, const v1::ContactBatch& batch) { return writer->Write(batch); });
}

grpc::Status Streams::WatchSeams(grpc::ServerContext* context, const v1::WatchSeamsRequest* request,
                                 grpc::ServerWriter<v1::SeamBatch>* writer) {
  return serve(seams_, context, *request,
               [&](const Seams&, const v1::SeamBatch& batch) { return writer->Write(batch); });
}

grpc::Status Streams::WatchDivergences(grpc::ServerContext* context,
                                       const v1::WatchDivergencesRequest* request,
                                       grpc::ServerWriter<v1::DivergenceBatch>* writer) {
  return serve(divergences_, context, *request,
               [&](const Divergences&, const v1::DivergenceBatch& batch) { return writer->Write(batch); });
}

grpc::Status Streams::WatchPrograms(grpc::ServerContext* context, const v1::WatchProgramsRequest* request,
                                    grpc::ServerWriter<v1::ProgramBatch>* writer) {
  if (absl::Status status = check_ids(*request); !status.ok()) return to_grpc(status);
  return serve(programs_, context, *request,
               [&](const Programs&, const v1::ProgramBatch& batch) { return writer->Write(batch); });
}

void Streams::shut_down() {
  const std::lock_guard lock(mutex_);
  closing_ = true;
  for_each_list([](const auto& list) {
    for (const auto& subscription : list) subscription->close();
  });
}

}  // namespace tessera
