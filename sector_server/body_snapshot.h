// What a stream tells of bodies at the end of a tick, before it is serialised.
#pragma once

#include <cstddef>
#include <vector>

#include "lpss/model/body.h"
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
  std::vector<Body> bodies;  // each once, in any order
  std::vector<BodyId> gone;  // ascending
  bool whole = false;        // nothing told before counts any more
};

std::size_t bytes_of(const BodySnapshot& snapshot);

// Writes the batch of a snapshot, all of it, in columns or body by body.
void describe(const BodySnapshot& snapshot, NodeId node, bool in_columns, v1::BodyBatch& batch);

}  // namespace tessera
