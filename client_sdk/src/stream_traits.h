// The streams of a sector server: what is asked for, and how a batch becomes part of a frame
// (server_stream.h).
#pragma once

#include <absl/status/statusor.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "client_sdk/src/body_news.h"
#include "proto/convert.h"
#include "proto/packed_bodies.h"
#include "tessera.grpc.pb.h"
#include "tessera/stream.h"

namespace tessera {

// Whether all columns are of the same bodies.
inline bool agree(const v1::BodyColumns& columns) {
  const int count = columns.ids_size();
  return columns.sector_size() == count && columns.positions_size() == 3 * count &&
         columns.orientations_size() == 4 * count && columns.linear_velocities_size() == 3 * count &&
         columns.angular_velocities_size() == 3 * count && columns.asleep_size() == count &&
         std::all_of(columns.sector().begin(), columns.sector().end(), [&](std::uint32_t place) {
           return place < static_cast<std::uint32_t>(columns.sectors_size());
         });
}

// Reads the batches of one call, in their order.
class BodyReader {
 public:
  explicit BodyReader(const v1::WatchBodiesRequest& request)
      : unpacker_({request.precision(), request.velocity_precision()}) {}

  absl::StatusOr<BodyNews> read(const v1::BodyBatch& batch) {
    BodyNews news;
    news.tick = batch.tick();
    news.servers = {batch.node()};
    if (batch.whole()) {
      news.whole = {batch.node()};
      unpacker_.clear();
    }
    for (const std::uint64_t id : batch.gone()) {
      news.gone.push_back({BodyId{id}, batch.node()});
      unpacker_.forget(BodyId{id});
    }
    const absl::Status status = batch.has_packed() ? read(batch.packed(), news) : read(batch.columns(), news);
    if (!status.ok()) return status;
    for (BodySample& body : news.bodies) body.server = batch.node();
    return news;
  }

 private:
  absl::Status read(const v1::PackedBodies& packed, BodyNews& news) {
    return unpacker_.read(packed, [&](const PackedBody& body) {
      news.bodies.push_back({body.id, body.pose, body.linear_velocity, body.angular_velocity, body.asleep});
    });
  }
  static absl::Status read(const v1::BodyColumns& columns, BodyNews& news) {
    if (!agree(columns)) return absl::DataLossError("it told of bodies in columns of different lengths");
    std::vector<SectorIndex> sectors;
    for (const v1::SectorIndex& sector : columns.sectors()) sectors.push_back(from_proto(sector));
    news.bodies.resize(static_cast<std::size_t>(columns.ids_size()));
    for (int n = 0; n < columns.ids_size(); ++n) {
      BodySample& body = news.bodies[n];
      body.id = BodyId{columns.ids(n)};
      body.pose.position = {sectors[columns.sector(n)], Eigen::Vector3d(&columns.positions().Get(3 * n))};
      body.pose.orientation = Eigen::Quaterniond(&columns.orientations().Get(4 * n));
      body.linear_velocity = Eigen::Vector3d(&columns.linear_velocities().Get(3 * n));
      body.angular_velocity = Eigen::Vector3d(&columns.angular_velocities().Get(3 * n));
      body.asleep = columns.asleep(n);
    }
    return absl::OkStatus();
  }

  BodyUnpacker unpacker_;
};

// Reads the batches of one call, which do not refer to each other.
template <typename Traits>
struct PlainReader {
  explicit PlainReader(const typename Traits::Request&) {}

  absl::StatusOr<typename Traits::Frame> read(const typename Traits::Batch& batch) {
    return Traits::read(batch);
  }
};

struct BodyTraits {
  using Frame = BodyNews;
  using Request = v1::WatchBodiesRequest;
  using Batch = v1::BodyBatch;
  using Reader = BodyReader;

  static auto open(v1::Streams::Stub& stub, grpc::ClientContext* context, const Request& request) {
    return stub.WatchBodies(context, request);
  }
};

struct ContactTraits {
  using Reader = PlainReader<ContactTraits>;
  using Frame = ContactFrame;
  using Request = v1::WatchContactsRequest;
  using Batch = v1::ContactBatch;
  static auto open(v1::Streams::Stub& stub, grpc::ClientContext* context, const Request& request) {
    return stub.WatchContacts(context, request);
  }
  static ContactPhase phase_of(v1::Contact::Phase phase) {
    if (phase == v1::Contact::BEGIN) return ContactPhase::kBegin;
    return phase == v1::Contact::END ? ContactPhase::kEnd : ContactPhase::kPersist;
  }
  static Frame read(const Batch& batch) {
    Frame frame{batch.tick(), {}};
    for (const v1::Contact& contact : batch.contacts()) {
      frame.contacts.push_back({phase_of(contact.phase()), BodyId{contact.a()}, BodyId{contact.b()},
                                from_proto(contact.position()), from_proto(contact.normal()),
                                contact.impulse(), from_proto(contact.friction()), points_of(contact)});
    }
    return frame;
  }
  static std::vector<ContactPointSample> points_of(const v1::Contact& contact) {
    std::vector<ContactPointSample> points;
    const int count = std::min({contact.points_size() / 3, contact.depths_size(), contact.impulses_size()});
    for (int n = 0; n < count; ++n) {
      points.push_back({{contact.points(3 * n), contact.points(3 * n + 1), contact.points(3 * n + 2)},
                        contact.depths(n),
                        contact.impulses(n)});
    }
    return points;
  }
};

struct SeamTraits {
  using Reader = PlainReader<SeamTraits>;
  using Frame = SeamFrame;
  using Request = v1::WatchSeamsRequest;
  using Batch = v1::SeamBatch;

  static auto open(v1::Streams::Stub& stub, grpc::ClientContext* context, const Request& request) {
    return stub.WatchSeams(context, request);
  }
  static Frame read(const Batch& batch) {
    Frame frame{batch.tick(), {}, {}};
    for (const v1::SeamBatch::Clone& clone : batch.clones()) {
      frame.clones.push_back({BodyId{clone.body()}, from_proto(clone.sector()), batch.node()});
    }
    for (const v1::SeamBatch::Island& island : batch.islands()) {
      IslandSample& sample = frame.islands.emplace_back(IslandSample{BodyId{island.id()}, {}});
      for (const std::uint64_t id : island.bodies()) sample.bodies.push_back(BodyId{id});
    }
    return frame;
  }
};

struct DivergenceTraits {
  using Reader = PlainReader<DivergenceTraits>;
  using Frame = DivergenceFrame;
  using Request = v1::WatchDivergencesRequest;
  using Batch = v1::DivergenceBatch;

  static auto open(v1::Streams::Stub& stub, grpc::ClientContext* context, const Request& request) {
    return stub.WatchDivergences(context, request);
  }
  static Frame read(const Batch& batch) {
    Frame frame{batch.tick(), {}};
    for (const v1::Divergence& divergence : batch.divergences())
      frame.divergences.push_back(from_proto(divergence));
    return frame;
  }
};

}  // namespace tessera
