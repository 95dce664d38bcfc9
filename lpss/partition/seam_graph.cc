#include "lpss/partition/seam_graph.h"

#include <algorithm>

namespace tessera {
namespace {

bool share_same_bodies(const std::vector<SeamPart>& known, const std::vector<IslandPart>& said) {
  return std::equal(known.begin(), known.end(), said.begin(), said.end(),
                    [](const SeamPart& a, const IslandPart& b) { return a.said.shared == b.shared; });
}

// All parts that joins lead to from one.
std::vector<const SeamPart*> all_joined(const SeamPart& first, absl::flat_hash_set<const SeamPart*>& seen) {
  std::vector<const SeamPart*> members = {&first};
  for (std::size_t n = 0; n < members.size(); ++n) {
    for (const SeamPart* other : members[n]->joined) {
      if (seen.insert(other).second) members.push_back(other);
    }
  }
  return members;
}

SeamIsland joined_from(std::vector<const SeamPart*> members) {
  std::sort(members.begin(), members.end(),
            [](const SeamPart* a, const SeamPart* b) { return a->said.first < b->said.first; });
  SeamIsland island;
  island.id = members.front()->said.first;
  for (const SeamPart* part : members) {
    island.parts.push_back(part->place);
    island.all_want_sleep &= part->said.all_want_sleep;
    island.contacts += part->said.contacts;
    island.bodies += part->said.bodies;
    island.substeps = std::max(island.substeps, static_cast<int>(part->said.substeps));
    island.bounces |= part->said.bounces;
    island.is_indivisible |= part->said.is_indivisible;
  }
  return island;
}

}  // namespace

void SeamGraph::join(SeamPart& part) {
  for (const BodyId body : part.said.shared) {
    auto& sharing = by_body_[body];
    for (SeamPart* other : sharing) {
      if (other == &part) continue;
      other->joined.push_back(&part);
      part.joined.push_back(other);
    }
    sharing.push_back(&part);
  }
}

void SeamGraph::separate(const SeamPart& part) {
  for (SeamPart* other : part.joined) {
    other->joined.erase(std::remove(other->joined.begin(), other->joined.end(), &part), other->joined.end());
  }
  for (const BodyId body : part.said.shared) {
    const auto sharing = by_body_.find(body);
    if (sharing == by_body_.end()) continue;
    const auto rest = std::remove(sharing->second.begin(), sharing->second.end(), &part);
    sharing->second.erase(rest, sharing->second.end());
    if (sharing->second.empty()) by_body_.erase(sharing);
  }
}

// Mostly the shared bodies are those of the tick before.
void SeamGraph::replace(const SectorSeams& seams) {
  if (const auto known = parts_.find(seams.sector); known != parts_.end()) {
    std::vector<SeamPart>& parts = known->second;
    if (share_same_bodies(parts, seams.parts)) {
      for (std::size_t n = 0; n < parts.size(); ++n) parts[n].said = seams.parts[n];
      return;
    }
    for (const SeamPart& part : parts) separate(part);
    parts_.erase(known);
  }
  if (seams.parts.empty()) return;
  std::vector<SeamPart>& parts = parts_[seams.sector];
  parts.resize(seams.parts.size());
  for (std::uint32_t n = 0; n < parts.size(); ++n) {
    parts[n].said = seams.parts[n];
    parts[n].place = {seams.sector, n};
  }
  for (SeamPart& part : parts) join(part);
}

std::vector<SectorSeams> SeamGraph::reported() const {
  std::vector<SectorSeams> reported;
  reported.reserve(parts_.size());
  for (const auto& [sector, parts] : parts_) {
    SectorSeams& seams = reported.emplace_back();
    seams.sector = sector;
    for (const SeamPart& part : parts) seams.parts.push_back(part.said);
  }
  std::sort(reported.begin(), reported.end(),
            [](const SectorSeams& a, const SectorSeams& b) { return a.sector < b.sector; });
  return reported;
}

std::span<const SeamPart> SeamGraph::parts_of(const SectorIndex& sector) const {
  if (parts_.empty()) return {};
  const auto parts = parts_.find(sector);
  if (parts == parts_.end()) return {};
  return parts->second;
}

std::vector<std::vector<const SeamPart*>> SeamGraph::parts_of_awake(
    std::span<const SectorIndex> awake) const {
  std::vector<std::vector<const SeamPart*>> islands;
  absl::flat_hash_set<const SeamPart*> seen;
  for (const SectorIndex& sector : awake) {
    for (const SeamPart& part : parts_of(sector)) {
      if (part.said.any_awake && seen.insert(&part).second) islands.push_back(all_joined(part, seen));
    }
  }
  return islands;
}

SeamIsland SeamGraph::island_of(const PartRef& ref) const {
  const SeamPart& part = parts_of(ref.sector)[ref.part];
  absl::flat_hash_set<const SeamPart*> seen = {&part};
  return joined_from(all_joined(part, seen));
}

std::vector<SeamIsland> SeamGraph::awake_islands(std::span<const SectorIndex> awake) const {
  std::vector<SeamIsland> islands;
  absl::flat_hash_set<const SeamPart*> seen;
  for (const SectorIndex& sector : awake) {
    for (const SeamPart& part : parts_of(sector)) {
      if (part.is_alone() || !part.said.any_awake || !seen.insert(&part).second) continue;
      islands.push_back(joined_from(all_joined(part, seen)));
    }
  }
  std::sort(islands.begin(), islands.end(),
            [](const SeamIsland& a, const SeamIsland& b) { return a.id < b.id; });
  return islands;
}

}  // namespace tessera
