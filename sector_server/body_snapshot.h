// What a stream tells of bodies at the end of a tick, before it is serialised.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "lpss/model/body.h"
#include "proto/packed_bodies.h"
#include "tessera.pb.h"
#include "transport/link.h"

namespace tessera {

// Made between ticks, and serialised on the thread that sends it, so that ticks do not wait for that.
struct BodySnapshot {
  struct Body {
    BodyId id;
    SectorIndex home;
    BodyState state;
    Pose centre_frame;  // in the body frame
  };

  std::uint64_t tick = 0;
  v1::StreamSource source;
  double sector_size = 0;
  std::vector<Body> bodies;    // each once, in any order
  std::vector<BodyId> gone;    // ascending
  bool whole = false;          // nothing told before counts any more
  std::uint64_t deferred = 0;  // bodies that have changed, and are told later
  std::size_t reserved = 0;    // bytes of the budget of its stream
};

std::size_t bytes_of(const BodySnapshot& snapshot);

// Writes the batches of one call, as its request asks for.
class BodyBatches {
 public:
  explicit BodyBatches(const v1::WatchBodiesRequest& request);

  // All snapshots that are sent, in their order.
  void write(const BodySnapshot& snapshot, NodeId node, v1::BodyBatch& batch);

 private:
  const bool in_columns_;
  std::optional<BodyPacker> packer_;
};

// What the request says of precision; nothing where it wants all digits. INVALID_ARGUMENT.
absl::StatusOr<std::optional<PackedPrecision>> precision_of(const v1::WatchBodiesRequest& request);

}  // namespace tessera
