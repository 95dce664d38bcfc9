#include "sector_server/streams.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <chrono>

#include "lpss/observe/seams.h"
#include "lpss/observe/state.h"
#include "lpss/simulation/simulation.h"
#include "lpss/tick/events.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// How often a waiting stream checks whether its client is still connected.
constexpr std::chrono::milliseconds kPatience(200);

// The box of the world that a client watches; the whole world if it named none.
class WatchedBox {
 public:
  template <typename Request>
  WatchedBox(const Request& request, double sector_size) : sector_size_(sector_size) {
    if (!request.has_region()) return;
    centre_ = from_proto(request.region().centre());
    half_ = from_proto(request.region().half_size());
  }

  bool holds(const WorldPosition& position) const {
    return !centre_ || (away(position).array() <= half_.array()).all();
  }
  // False only if no body of the sector can be in the box; bodies may be slightly beyond the sector's
  // borders.
  bool may_hold_bodies_of(const SectorIndex& sector) const {
    return !centre_ ||
           (away({sector, Eigen::Vector3d::Zero()}).array() <= half_.array() + sector_size_).all();
  }

 private:
  Eigen::Vector3d away(const WorldPosition& position) const {
    return (relative_to(position, centre_->sector, sector_size_) - centre_->local).cwiseAbs();
  }

  double sector_size_;
  std::optional<WorldPosition> centre_;
  Eigen::Vector3d half_ = Eigen::Vector3d::Zero();
};

// Of a BodyRecord or BodyView.
template <typename Body>
WorldPosition position_of(const Body& record) {
  return {record.home, Eigen::Vector3d(record.state.position.data())};
}

void describe(const BodySnapshot::Body& body, double sector_size, v1::BodyState& state) {
  state.set_id(body.id.value);
  *state.mutable_pose() = to_proto(body_pose(body.home, body.state, body.centre_frame, sector_size));
  *state.mutable_linear_velocity() = to_proto(Eigen::Vector3d(body.state.linear_velocity.data()));
  *state.mutable_angular_velocity() = to_proto(Eigen::Vector3d(body.state.angular_velocity.data()));
  state.set_asleep(body.state.activity == Activity::kAsleep);
}

void put(const Eigen::Vector3d& vector, google::protobuf::RepeatedField<double>& column) {
  for (int axis = 0; axis < 3; ++axis) column.AddAlreadyReserved(vector[axis]);
}

using BodiesInOrder = std::vector<const BodySnapshot::Body*>;

BodiesInOrder by_id(const BodySnapshot& snapshot) {
  BodiesInOrder bodies;
  bodies.reserve(snapshot.bodies.size());
  for (const BodySnapshot::Body& body : snapshot.bodies) bodies.push_back(&body);
  std::sort(bodies.begin(), bodies.end(), [](const auto* a, const auto* b) { return a->id < b->id; });
  return bodies;
}

void describe(const BodiesInOrder& bodies, double sector_size, v1::BodyColumns& columns) {
  const int count = static_cast<int>(bodies.size());
  columns.mutable_ids()->Reserve(count);
  columns.mutable_sector()->Reserve(count);
  columns.mutable_positions()->Reserve(3 * count);
  columns.mutable_orientations()->Reserve(4 * count);
  columns.mutable_linear_velocities()->Reserve(3 * count);
  columns.mutable_angular_velocities()->Reserve(3 * count);
  columns.mutable_asleep()->Reserve(count);
  absl::flat_hash_map<SectorIndex, std::uint32_t> places;
  for (const BodySnapshot::Body* body : bodies) {
    const BodyState& state = body->state;
    const WorldPose pose = body_pose(body->home, state, body->centre_frame, sector_size);
    const auto [place, is_new] = places.try_emplace(pose.position.sector, places.size());
    if (is_new) *columns.add_sectors() = to_proto(pose.position.sector);
    columns.mutable_ids()->AddAlreadyReserved(body->id.value);
    columns.mutable_sector()->AddAlreadyReserved(place->second);
    put(pose.position.local, *columns.mutable_positions());
    for (const double part : pose.orientation.coeffs())
      columns.mutable_orientations()->AddAlreadyReserved(part);
    put(Eigen::Vector3d(state.linear_velocity.data()), *columns.mutable_linear_velocities());
    put(Eigen::Vector3d(state.angular_velocity.data()), *columns.mutable_angular_velocities());
    columns.mutable_asleep()->AddAlreadyReserved(state.activity == Activity::kAsleep);
  }
}

// A static body is sent by the server that hosts its sector, because all servers know it.
const BodyRecord* hosted_static(const Partition& partition, BodyId id) {
  const BodyRecord* record = partition.statics.find(id);
  return record != nullptr && partition.hosts(record->home) ? record : nullptr;
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

// Reuses the memory of `snapshot`.
BodySnapshot bodies_for(const v1::WatchBodiesRequest& request, Tick tick, const Partition& partition,
                        BodySnapshot snapshot) {
  snapshot.tick = tick;
  snapshot.sector_size = partition.sector_size();
  snapshot.bodies.clear();
  const WatchedBox box(request, snapshot.sector_size);
  const auto consider = [&](const auto& body) {
    if (request.only_awake() && body.state.activity == Activity::kAsleep) return;
    if (!box.holds(position_of(body))) return;
    snapshot.bodies.push_back({body.id, body.home, body.state, centre_frame(body.properties)});
  };
  if (request.ids().empty()) {
    for_each_body_in(
        partition, [&](const SectorIndex& sector) { return box.may_hold_bodies_of(sector); }, consider);
    return snapshot;
  }
  std::vector<std::uint64_t> ids(request.ids().begin(), request.ids().end());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  for (const std::uint64_t id : ids) {
    if (const std::optional<BodyRecord> record = body_of(partition, BodyId{id})) {
      consider(*record);
    } else if (const BodyRecord* fixed = hosted_static(partition, BodyId{id});
               fixed != nullptr && !request.only_awake()) {
      consider(*fixed);
    }
  }
  return snapshot;
}

}  // namespace

v1::ContactBatch Streams::contacts_for(const v1::WatchContactsRequest& request, Tick tick,
                                       const std::vector<ContactEvent>& events) const {
  v1::ContactBatch batch;
  batch.set_tick(tick);
  batch.set_node(node_.value);
  const absl::flat_hash_set<std::uint64_t> ids(request.ids().begin(), request.ids().end());
  for (const ContactEvent& event : events) {
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

v1::SeamBatch Streams::seams_for(const v1::WatchSeamsRequest& request, Tick tick,
                                 const Partition& partition) const {
  v1::SeamBatch batch;
  batch.set_tick(tick);
  batch.set_node(node_.value);
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
  v1::DivergenceBatch batch;
  batch.set_tick(tick);
  batch.set_node(node_.value);
  for (const Divergence& divergence : first_divergences(divergences))
    *batch.add_divergences() = to_proto(divergence);
  return batch;
}

void Streams::publish(Tick tick, TickMachine& machine, bool new_only) {
  const Partition& partition = machine.partition();
  const std::lock_guard lock(mutex_);
  const auto publish_states = [&](const auto& subscriptions, const auto& states_for) {
    for (const auto& subscription : subscriptions) {
      const std::uint64_t every = std::max<std::uint64_t>(subscription->request().every_ticks(), 1);
      const bool wanted = new_only ? !subscription->served : tick % every == 0;
      if (!wanted) continue;
      subscription->served = true;
      subscription->push(states_for(*subscription));
    }
  };
  publish_states(bodies_, [&](Bodies& subscription) {
    return bodies_for(subscription.request(), tick, partition, subscription.spare());
  });
  publish_states(seams_,
                 [&](Seams& subscription) { return seams_for(subscription.request(), tick, partition); });
  for (const std::shared_ptr<Contacts>& subscription : contacts_) {
    // The first batch only states the tick from which on the stream is complete.
    const bool counts = subscription->served && !new_only;
    if (!counts && subscription->served) continue;
    v1::ContactBatch batch;
    batch.set_tick(tick);
    batch.set_node(node_.value);
    if (counts) batch = contacts_for(subscription->request(), tick, machine.contact_events());
    subscription->served = true;
    subscription->push(std::move(batch));
  }
  // Likewise.
  for (const std::shared_ptr<Divergences>& subscription : divergences_) {
    const bool counts = subscription->served && !new_only;
    if (!counts && subscription->served) continue;
    static const std::vector<Divergence> kNone;
    subscription->push(divergences_in(tick, counts ? machine.divergences() : kNone));
    subscription->served = true;
  }
  report_contacts(machine.partition(), !contacts_.empty());
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
    auto batch = subscription->next(kPatience);
    if (!batch) continue;
    if (!send(*batch)) break;
    subscription->take_back(*std::move(batch));
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
  v1::BodyBatch batch;  // reused for all batches, with its memory
  return serve(bodies_, context, *request, [&](const BodySnapshot& snapshot) {
    batch.Clear();
    batch.set_tick(snapshot.tick);
    batch.set_node(node_.value);
    const BodiesInOrder bodies = by_id(snapshot);
    if (request->in_columns()) {
      describe(bodies, snapshot.sector_size, *batch.mutable_columns());
    } else {
      for (const auto* body : bodies) describe(*body, snapshot.sector_size, *batch.add_bodies());
    }
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

grpc::Status Streams::WatchDivergences(grpc::ServerContext* context,
                                       const v1::WatchDivergencesRequest* request,
                                       grpc::ServerWriter<v1::DivergenceBatch>* writer) {
  return serve(divergences_, context, *request,
               [&](const v1::DivergenceBatch& batch) { return writer->Write(batch); });
}

void Streams::shut_down() {
  const std::lock_guard lock(mutex_);
  closing_ = true;
  for (const auto& subscription : bodies_) subscription->close();
  for (const auto& subscription : contacts_) subscription->close();
  for (const auto& subscription : seams_) subscription->close();
  for (const auto& subscription : divergences_) subscription->close();
}

}  // namespace tessera
