// Gathering: servers come to know those islands whole that they have a part of.
//
// Each tells the servers around its parts what it knows of an island, then what it has learned since, and so
// on until nobody learns anything more: an island over n servers in a row takes n - 1 rounds, and a world of
// any number of servers no more than its longest island.
#pragma once

#include <absl/container/btree_set.h>
#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>

#include <functional>
#include <map>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/joint_ends.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/recipients.h"

namespace tessera {

class Gathering {
 public:
  // With what was found here in this tick. Parts of others in the seam graph are forgotten. What is passed by
  // reference outlives this.
  Gathering(Partition& partition, const Seams& found, const JointHosts& joint_hosts);

  // What those servers have not been told yet that `is_wanted` is true of; by rank.
  std::map<Rank, Seams> news(const std::function<bool(Rank)>& is_wanted);

  void take(Rank from, const Seams& seams);

  // The sectors that were found or heard of with what they are in this tick, ascending.
  std::vector<SectorIndex> awake() const { return {awake_.begin(), awake_.end()}; }

 private:
  // The servers that may have a part of the same island, next to this one.
  const Ranks& around(const SeamPart& part);

  Partition& partition_;
  const JointHosts& joint_hosts_;
  absl::btree_set<SectorIndex> awake_;
  absl::flat_hash_map<const SeamPart*, Ranks> around_;      // of parts here
  std::map<Rank, absl::flat_hash_set<SectorIndex>> known_;  // to others
};

// Forgets the parts of others: the map has changed, and some may have become one's own.
void forget_parts_of_others(Partition& partition);

}  // namespace tessera
