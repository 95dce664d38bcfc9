// Worlds that grow with their servers: what one server has to do with others must not grow with them.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "lpss/model/world_description.h"
#include "lpss/tick/round.h"

namespace tessera {

// Sectors of a server in a row, or in a square block of a plane.
inline constexpr int kSectorsPerServer = 16;

enum class Layout { kRow, kPlane, kJointedRow };

// Sectors of 16 m, kSectorsPerServer for each of `servers` (of a plane: a power of two). In each stand a
// tower of two boxes, and boxes that touch others across the borders with the next sectors: four bodies, or
// six in a plane, that never sleep. Nothing comes near the rim of the world. In a jointed row, joints hold
// the boxes of each tower together, and those across each border: two a sector.
WorldDescription neighbours_world(Layout layout, int servers, Precision precision);

// Figures of one server and tick.
struct PerServer {
  double mean = 0;
  double largest = 0;  // of the server with most
};

struct NeighboursRun {
  PerServer messages;                                          // sent and received
  PerServer bytes;                                             // likewise
  PerServer peers;                                             // servers that it exchanges messages with
  std::array<double, kRoundNames.size()> messages_by_round{};  // sent, mean
  std::array<double, kRoundNames.size()> bytes_by_round{};
  double heap_kb = 0;  // of a server, mean
  PerServer joints;    // that it knows
  std::string hash;
  std::string hash_of_one;  // of one process, after as many ticks
};

// Runs `ticks`, of which the second half counts, on partitions of one process. Up to `all_linked_max` servers
// all talk to each other. Errors: CANCELLED where `go_on` says so.
absl::StatusOr<NeighboursRun> run_neighbours(const WorldDescription& world, std::uint32_t servers,
                                             std::uint32_t all_linked_max, Tick ticks,
                                             const std::function<bool()>& go_on);

}  // namespace tessera
