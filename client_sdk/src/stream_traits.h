// The streams of a sector server: what is asked for, and how a batch becomes part of a frame
// (server_stream.h).
#pragma once

#include <absl/status/statusor.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "client_sdk/src/body_news.h"
#include "client_sdk/src/body_sample.h"
#include "client_sdk/src/contact_sample.h"
#include "proto/convert.h"
#include "proto/packed_bodies.h"
#include "tessera.grpc.pb.h"
#include "tessera/stream.h"

namespace tessera {

// Reads the batches of one call, in their order.
class BodyReader {
 public:
  explicit BodyReader(const v1::WatchBodiesRequest& request)
      : unpacker_({request.precision(), request.velocity_precision()}) {}

  absl::StatusOr<BodyNews> read(const v1::BodyBatch& batch) {
    BodyNews news;
    news.tick = batch.tick();
    news.servers = {batch.node()};
    news.deferred = batch.deferred();
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
    return unpacker_.read(packed, [&](const BodyRow& body) { news.bodies.push_back(sample_of(body)); });
  }
  static absl::Status read(const v1::BodyColumns& columns, BodyNews& news) {
    std::vector<BodyRow> rows;
    if (!append_rows(columns, rows).ok())
      return absl::DataLossError("it told of bodies in columns of different lengths");
    news.bodies.reserve(rows.size());
    for (const BodyRow& row : rows) news.bodies.push_back(sample_of(row));
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
  static Frame read(const Batch& batch) {
    Frame frame{batch.tick(), {}};
    for (const v1::Contact& contact : batch.contacts()) frame.contacts.push_back(contact_sample(contact));
    return frame;
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

struct ProgramTraits {
  using Reader = PlainReader<ProgramTraits>;
  using Frame = ProgramFrame;
  using Request = v1::WatchProgramsRequest;
  using Batch = v1::ProgramBatch;

  static auto open(v1::Streams::Stub& stub, grpc::ClientContext* context, const Request& request) {
    return stub.WatchPrograms(context, request);
  }
  static absl::StatusOr<Frame> read(const Batch& batch) {
    const auto corrupt = [] { return absl::DataLossError("it told of programs in columns that do not fit"); };
    const int count = batch.bodies_size();
    for (const int other :
         {batch.programs_size(), batch.kind_size(), batch.counts_size(), batch.stopped_size()})
      if (other != count) return corrupt();
    Frame frame{batch.tick(), {}};
    auto value = batch.values().begin();
    for (int n = 0; n < count; ++n) {
      const bool has_kind = batch.kind(n) < static_cast<std::uint32_t>(batch.kinds_size());
      if (!has_kind || batch.counts(n) > batch.values().end() - value) return corrupt();
      ProgramSample& sample = frame.programs.emplace_back();
      sample.body = BodyId{batch.bodies(n)};
      sample.program = batch.programs(n);
      sample.kind = batch.kinds(static_cast<int>(batch.kind(n)));
      sample.stopped = batch.stopped(n);
      sample.values.assign(value, value + batch.counts(n));
      sample.tick = batch.tick();
      value += batch.counts(n);
    }
    return frame;
  }
};

}  // namespace tessera
