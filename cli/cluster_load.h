// What the servers and the sectors of a cluster have to do, and tables of it.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tessera/client.h"

namespace tessera::cli {

struct SectorLoad {
  SectorIndex sector;
  std::uint64_t server = 0;  // the node that hosts it
  std::uint64_t awake = 0;   // bodies that are awake
  std::uint64_t bodies = 0;  // whose frames lie in it, static ones not counted
  std::uint64_t clones = 0;  // of bodies of other sectors
};

struct ServerLoad : ServerStatus {
  std::uint64_t awake = 0;  // bodies that are awake, in all its sectors
};

struct ClusterLoad {
  ClusterStatus status;
  std::vector<ServerLoad> servers;
  absl::StatusOr<std::vector<SectorLoad>> sectors;  // or why they are not known
};

// Ascending by index: all sectors with a body that can move or a clone.
std::vector<SectorLoad> sector_loads(const BodyFrame& bodies, const SeamFrame& seams);

ClusterLoad cluster_load(ClusterStatus status, absl::StatusOr<std::vector<SectorLoad>> sectors);

// By what a table can be sorted. Ticks take servers about the same time, since they wait for each other: who
// is busy shows in the bodies that are awake.
inline constexpr const char* kSortDefault = "awake";
std::vector<std::string> sort_columns();

// Servers and sectors descending by `column`, where that is one of theirs; then by bodies awake, then by
// bodies.
void sort_by(absl::string_view column, ClusterLoad& load);

struct LoadTables {
  bool servers = true;
  bool sectors = true;
};

// The summary of the status and the tables, in at most so many lines: of each as many rows as fit, and how
// many there are beyond. nullopt: all.
std::string to_text(const ClusterLoad& load, const LoadTables& tables, std::optional<std::size_t> lines);

// The status, its servers in their order, and all sectors in theirs as "sectors_by_load".
nlohmann::json to_json(const ClusterLoad& load);

}  // namespace tessera::cli
