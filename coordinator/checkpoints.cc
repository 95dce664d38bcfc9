#include "coordinator/checkpoints.h"

#include <string>
#include <utility>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

void apply_changes(const KeptChunks& changes, KeptChunks& state) {
  for (const auto& [key, chunk] : changes) apply(chunk, state);
}

// A sector that has changed servers is gone from one, and new at another.
KeptChunks by_keys(std::vector<v1::SnapshotChunk> chunks) {
  KeptChunks all;
  for (const bool are_absences : {true, false}) {
    for (v1::SnapshotChunk& chunk : chunks) {
      if (is_absence(chunk) != are_absences) continue;
      put(std::make_shared<const v1::SnapshotChunk>(std::move(chunk)), all);
    }
  }
  return all;
}

bool are_same(const v1::SnapshotChunk& a, const v1::SnapshotChunk& b) {
  return a.kind_case() == b.kind_case() && a.sectors() == b.sectors() && a.shared() == b.shared();
}

// What leads from one state to another.
KeptChunks difference(const KeptChunks& from, KeptChunks to) {
  for (const auto& [key, chunk] : from) {
    const auto found = to.find(key);
    if (found == to.end()) {
      put(absence_of(key), to);
    } else if (are_same(*found->second, *chunk)) {
      to.erase(found);
    }
  }
  return to;
}

}  // namespace

const KeptChunks& Checkpoints::add(Tick tick, std::vector<v1::SnapshotChunk> chunks, bool are_all,
                                   Nanoseconds now) {
  invariant(tick > latest(), "checkpoints come in their order");
  KeptChunks changes = by_keys(std::move(chunks));
  if (are_all) changes = difference(latest_state(), std::move(changes));
  settle(now);
  return later_.emplace_back(Later{{tick, std::move(changes)}, now}).changes.chunks;
}

void Checkpoints::settle(Nanoseconds now) {
  while (!later_.empty() && later_.front().time + kStreamSlack <= now) {
    const Checkpoint& next = later_.front().changes;
    apply_changes(next.chunks, earliest_.chunks);
    earliest_.tick = next.tick;
    start_.reset();
    later_.pop_front();
  }
}

KeptChunks Checkpoints::latest_state() const {
  KeptChunks state = earliest_.chunks;
  for (const Later& later : later_) apply_changes(later.changes.chunks, state);
  return state;
}

absl::StatusOr<Placement> Checkpoints::place_earliest(std::uint64_t number, const WorldSettings& settings,
                                                      const SectorIndex& anchor,
                                                      std::vector<ShapeEntry> shapes,
                                                      std::span<const Host> hosts, std::uint64_t map_epoch,
                                                      BalancePolicy policy) const {
  if (start_) return place(number, *start_, hosts, map_epoch, policy);
  return place(number, {earliest_.tick, settings, anchor, std::move(shapes), earliest_.chunks}, hosts,
               map_epoch, policy);
}

v1::LoadWorld Checkpoints::guest_load(std::uint64_t number, const WorldSettings& settings,
                                      const SectorIndex& anchor, std::vector<ShapeEntry> shapes,
                                      std::span<const NodeId> nodes, const SectorMap& map) const {
  if (start_ && later_.empty()) return tessera::guest_load(number, *start_, nodes, map);
  const KeptChunks chunks = latest_state();
  return tessera::guest_load(number, KeptState{latest(), settings, anchor, std::move(shapes), chunks}, nodes,
                             map);
}

}  // namespace tessera
