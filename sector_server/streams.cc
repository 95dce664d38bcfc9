#include "sector_server/streams.h"

#include <absl/container/flat_hash_set.h>
#include <google/protobuf/arena.h>

#include <algorithm>
#include <chrono>

#include "lpss/world/simulation.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// How often a waiting stream looks whether its client is still there.
constexpr std::chrono::milliseconds kPatience(200);

bool within(const v1::Region& region, const WorldPosition& position, double sector_size) {
  const WorldPosition centre = from_proto(region.centre());
  const Eigen::Vector3d away = relative_to(position, centre.sector, sector_size) - centre.local;
  const Eigen::Vector3d half = from_proto(region.half_size());
  return (away.cwiseAbs().array() <= half.array()).all();
}

WorldPosition position_of(const BodyRecord& record) {
  return {record.home, Eigen::Vector3d(record.state.position.data())};
}

void describe(const BodyRecord& record, double sector_size, v1::BodyState& state) {
  state.set_id(record.id.value);
  *state.mutable_pose() = to_proto(body_pose(record, sector_size));
  *state.mutable_linear_velocity() = to_proto(Eigen::Vector3d(record.state.linear_velocity.data()));
  *state.mutable_angular_velocity() = to_proto(Eigen::Vector3d(record.state.angular_velocity.data()));
  state.set_asleep(record.state.activity == Activity::kAsleep);
}

// A static body, from the server that hosts its sector: all of them know it.
const BodyRecord* hosted_static(const Share& share, BodyId id) {
  const BodyRecord* record = share.statics().find(id);
  if (record == nullptr || share.options().map.owner(record->home) != share.options().self) return nullptr;
  return record;
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

BodySnapshot bodies_for(const v1::WatchBodiesRequest& request, Tick tick, const Share& share) {
  BodySnapshot snapshot{tick, share.options().settings.sector_size, {}};
  const auto consider = [&](const BodyRecord& record) {
    if (request.only_awake() && record.state.activity == Activity::kAsleep) return;
    if (request.has_region() && !within(request.region(), position_of(record), snapshot.sector_size)) return;
    snapshot.bodies.push_back(record);
  };
  if (request.ids().empty()) {
    share.for_each_body(consider);
    return snapshot;
  }
  std::vector<std::uint64_t> ids(request.ids().begin(), request.ids().end());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  for (const std::uint64_t id : ids) {
    if (const std::optional<BodyRecord> record = share.body(BodyId{id})) {
      consider(*record);
    } else if (const BodyRecord* fixed = hosted_static(share, BodyId{id});
               fixed != nullptr && !request.only_awake()) {
      consider(*fixed);
    }
  }
  return snapshot;
}

}  // namespace

v1::ContactBatch Streams::contacts_for(const v1::WatchContactsRequest& request, Tick tick,
                                       const Share& share) const {
  v1::ContactBatch batch;
  batch.set_tick(tick);
  batch.set_node(node_.value);
  const absl::flat_hash_set<std::uint64_t> ids(request.ids().begin(), request.ids().end());
  for (const ContactEvent& event : share.contact_events()) {
    if (event.phase == ContactPhase::kPersist && !request.persisting()) continue;
    if (!ids.empty() && !ids.contains(event.a.value) && !ids.contains(event.b.value)) continue;
    v1::Contact& contact = *batch.add_contacts();
    contact.set_phase(phase_of(event.phase));
    contact.set_a(event.a.value);
    contact.set_b(event.b.value);
    if (event.phase == ContactPhase::kEnd) continue;
    *contact.mutable_position() = to_proto(event.position);
    *contact.mutable_normal() = to_proto(Eigen::Vector3d(event.normal.data()));
    contact.set_impulse(event.impulse);
  }
  return batch;
}

v1::SeamBatch Streams::seams_for(const v1::WatchSeamsRequest& request, Tick tick, const Share& share) const {
  v1::SeamBatch batch;
  batch.set_tick(tick);
  batch.set_node(node_.value);
  const auto is_wanted = [&](const WorldPosition& position) {
    return !request.has_region() || within(request.region(), position, share.options().settings.sector_size);
  };
  for (const Share::CloneAt& clone : share.clones()) {
    if (!is_wanted(clone.position)) continue;
    v1::SeamBatch::Clone& added = *batch.add_clones();
    added.set_body(clone.body.value);
    *added.mutable_sector() = to_proto(clone.position.sector);
  }
  for (const Share::IslandHere& island : share.islands_across_seams()) {
    v1::SeamBatch::Island added;
    added.set_name(island.name.value);
    for (const BodyId id : island.bodies) {
      if (is_wanted(position_of(*share.body(id)))) added.add_bodies(id.value);
    }
    if (added.bodies_size() > 0) *batch.add_islands() = std::move(added);
  }
  return batch;
}

void Streams::publish(Tick tick, Share& share, bool new_only) {
  const std::lock_guard lock(mutex_);
  const auto publish_states = [&](const auto& subscriptions, const auto& states_for) {
    for (const auto& subscription : subscriptions) {
      const std::uint64_t every = std::max<std::uint64_t>(subscription->request().every_ticks(), 1);
      const bool wanted = new_only ? !subscription->served : tick % every == 0;
      if (!wanted) continue;
      subscription->served = true;
      subscription->push(states_for(subscription->request()));
    }
  };
  publish_states(bodies_, [&](const auto& request) { return bodies_for(request, tick, share); });
  publish_states(seams_, [&](const auto& request) { return seams_for(request, tick, share); });
  for (const std::shared_ptr<Contacts>& subscription : contacts_) {
    // The first batch only says from which tick on nothing is missed.
    const bool counts = subscription->served && !new_only;
    if (!counts && subscription->served) continue;
    v1::ContactBatch batch;
    batch.set_tick(tick);
    batch.set_node(node_.value);
    if (counts) batch = contacts_for(subscription->request(), tick, share);
    subscription->served = true;
    subscription->push(std::move(batch));
  }
  share.report_contacts(!contacts_.empty());
}

template <typename S, typename Request, typename Send>
grpc::Status Streams::serve(std::list<std::shared_ptr<S>>& list, grpc::ServerContext* context,
                            const Request& request, const Send& send) {
  auto subscription = std::make_shared<S>(request);
  {
    const std::lock_guard lock(mutex_);
    if (closing_) return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the server is shutting down");
    list.push_back(subscription);
  }
  wake_();
  while (subscription->alive() && !context->IsCancelled()) {
    const auto batch = subscription->next(kPatience);
    if (batch && !send(*batch)) break;
  }
  bool closing = false;
  {
    const std::lock_guard lock(mutex_);
    list.remove(subscription);
    closing = closing_;
  }
  if (subscription->overrun()) {
    return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "the client fell too far behind the stream");
  }
  return closing ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the server is shutting down")
                 : grpc::Status::OK;
}

grpc::Status Streams::WatchBodies(grpc::ServerContext* context, const v1::WatchBodiesRequest* request,
                                  grpc::ServerWriter<v1::BodyBatch>* writer) {
  return serve(bodies_, context, *request, [&](const BodySnapshot& snapshot) {
    google::protobuf::Arena arena;  // thousands of small messages: made and forgotten in one go
    auto& batch = *google::protobuf::Arena::CreateMessage<v1::BodyBatch>(&arena);
    batch.set_tick(snapshot.tick);
    batch.set_node(node_.value);
    for (const BodyRecord& record : snapshot.bodies)
      describe(record, snapshot.sector_size, *batch.add_bodies());
    return writer->Write(batch);
  });
}

grpc::Status Streams::WatchContacts(grpc::ServerContext* context, const v1::WatchContactsRequest* request,
                                    grpc::ServerWriter<v1::ContactBatch>* writer) {
  return serve(contacts_, context, *request,
               [&](const v1::ContactBatch& batch) { return writer->Write(batch); });
}

grpc::Status Streams::WatchSeams(grpc::ServerContext* context, const v1::WatchSeamsRequest* request,
                                 grpc::ServerWriter<v1::SeamBatch>* writer) {
  return serve(seams_, context, *request, [&](const v1::SeamBatch& batch) { return writer->Write(batch); });
}

void Streams::shut_down() {
  const std::lock_guard lock(mutex_);
  closing_ = true;
  for (const auto& subscription : bodies_) subscription->close();
  for (const auto& subscription : contacts_) subscription->close();
  for (const auto& subscription : seams_) subscription->close();
}

}  // namespace tessera
