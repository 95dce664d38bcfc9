#include "lpss/tick/gathering.h"

#include "lpss/base/invariant.h"
#include "lpss/partition/packing.h"

namespace tessera {

Gathering::Gathering(Partition& partition, const Seams& found, const JointHosts& joint_hosts)
    : partition_(partition), joint_hosts_(joint_hosts) {
  for (const SectorIndex& sector : std::exchange(partition.parts_of_others, {}))
    partition.seam_graph.replace({sector, {}});
  for (const SectorSeams& seams : found.sectors) {
    partition.seam_graph.replace(seams);
    awake_.insert(seams.sector);
  }
}

// All that know of a body come to the same set of those. A joint ties the parts that its two bodies live in.
const Ranks& Gathering::around(const SeamPart& part) {
  const auto [found, is_new] = around_.try_emplace(&part);
  Ranks& ranks = found->second;
  if (!is_new) return ranks;
  bring_back(partition_, part.place.sector);
  for (const BodyId id : part.said.shared) {
    if (const auto body = partition_.bodies.find(id); body != partition_.bodies.end()) {
      const HomeBody& home = *body->second;
      ranks |= owners(partition_.map, home.sector->index, home.replicated_in);
    } else if (const auto replica = partition_.replicas.find(id); replica != partition_.replicas.end()) {
      const Replica& known = *replica->second;
      ranks.insert(partition_.map.owner(known.home));
      ranks |= owners(partition_.map, known.home, known.replicated_in);
    } else {
      const auto host = joint_hosts_.find(id);
      invariant(host != joint_hosts_.end(), "a part shares bodies that its server knows of");
      ranks.insert(host->second);
    }
  }
  ranks.erase(partition_.self);
  return ranks;
}

std::map<Rank, Seams> Gathering::news(const std::function<bool(Rank)>& is_wanted) {
  std::map<Rank, Seams> outbox;
  for (const std::vector<const SeamPart*>& island : partition_.seam_graph.parts_of_awake(awake())) {
    Ranks listeners;
    absl::btree_set<SectorIndex> sectors;
    for (const SeamPart* part : island) {
      sectors.insert(part->place.sector);
      if (partition_.hosts(part->place.sector)) listeners |= around(*part);
    }
    listeners.for_each([&](Rank rank) {
      if (!is_wanted(rank)) return;
      absl::flat_hash_set<SectorIndex>& known = known_[rank];
      for (const SectorIndex& sector : sectors) {
        if (partition_.map.owner(sector) == rank || !known.insert(sector).second) continue;
        SectorSeams& seams = outbox[rank].sectors.emplace_back();
        seams.sector = sector;
        seams.is_news = awake_.contains(sector);
        for (const SeamPart& part : partition_.seam_graph.parts_of(sector)) seams.parts.push_back(part.said);
      }
    });
  }
  return outbox;
}

void Gathering::take(Rank from, const Seams& message) {
  for (const SectorSeams& seams : message.sectors) {
    invariant(!partition_.hosts(seams.sector), "nobody is told of its own sectors");
    known_[from].insert(seams.sector);
    partition_.seam_graph.replace(seams);
    partition_.parts_of_others.push_back(seams.sector);
    if (seams.is_news) awake_.insert(seams.sector);
  }
}

void forget_parts_of_others(Partition& partition) {
  for (const SectorIndex& sector : std::exchange(partition.parts_of_others, {}))
    partition.seam_graph.replace({sector, {}});
  partition.seam_graph.keep_only([&](const SectorIndex& sector) { return partition.hosts(sector); });
}

}  // namespace tessera
