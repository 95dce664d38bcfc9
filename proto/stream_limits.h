// What clients may ask of a stream.
#pragma once

#include <cstdint>

namespace tessera {

// WatchBodiesRequest.bytes_per_second, if it is not 0. A batch without bodies has some 50 bytes, so less
// would not be enough for one a tick.
inline constexpr std::uint64_t kBytesPerSecondMin = 10'000;
inline constexpr std::uint64_t kBytesPerSecondMax = 10'000'000'000;

// Bodies that a stream is asked for by their ids.
inline constexpr int kWatchedIdsMax = 100'000;
// Of all streams of a server: it tells the others of them, so that streams go on where it is lost.
inline constexpr int kAllWatchedIdsMax = 1'000'000;

}  // namespace tessera
