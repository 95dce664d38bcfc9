// What servers tell of bodies for a tick, before it becomes a frame.
#pragma once

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "client_sdk/src/stream_merger.h"
#include "tessera/stream.h"

namespace tessera {

// See BodyBatch in tessera.proto.
struct BodyNews {
  struct Gone {
    BodyId id;
    std::uint64_t server = 0;  // that has it no more
  };

  Tick tick = 0;
  std::vector<BodySample> bodies;      // ascending by id
  std::vector<Gone> gone;              // in any order
  std::vector<std::uint64_t> servers;  // that have told this
  std::vector<std::uint64_t> whole;    // of these, those of which nothing told before counts any more
  std::uint64_t deferred = 0;          // bodies that are told later
};

// Of different servers, at one tick.
inline void join(BodyNews& whole, BodyNews part) {
  join(whole.bodies, std::move(part.bodies), [](const auto& a, const auto& b) { return a.id < b.id; });
  whole.gone.insert(whole.gone.end(), part.gone.begin(), part.gone.end());
  whole.servers.insert(whole.servers.end(), part.servers.begin(), part.servers.end());
  whole.whole.insert(whole.whole.end(), part.whole.begin(), part.whole.end());
  whole.deferred += part.deferred;
}

// Of one server: `later` becomes what it would have told, had it not told `earlier`.
inline void carry_over(BodyNews& later, BodyNews earlier) {
  if (!later.whole.empty()) return;
  const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
  std::sort(later.gone.begin(), later.gone.end(), by_id);
  std::erase_if(earlier.bodies, [&](const BodySample& body) {
    return std::binary_search(later.bodies.begin(), later.bodies.end(), body, by_id) ||
           std::binary_search(later.gone.begin(), later.gone.end(), BodyNews::Gone{body.id}, by_id);
  });
  std::erase_if(earlier.gone, [&](const BodyNews::Gone& gone) {
    BodySample body;
    body.id = gone.id;
    return std::binary_search(later.bodies.begin(), later.bodies.end(), body, by_id);
  });
  join(later.bodies, std::move(earlier.bodies), by_id);
  later.gone.insert(later.gone.end(), earlier.gone.begin(), earlier.gone.end());
  later.whole = std::move(earlier.whole);
}

}  // namespace tessera
