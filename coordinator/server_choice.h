// Which servers of the cluster a world is to have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/membership.h"
#include "coordinator/placement.h"
#include "lpss/model/world_description.h"
#include "proto/server_traits.h"
#include "transport/link.h"

namespace tessera {

class ServerChoice {
 public:
  // `wanted`: so many servers; 0: all that have these labels.
  ServerChoice(const Membership& members, std::uint32_t wanted, Labels required)
      : members_(members), wanted_(wanted), required_(std::move(required)) {}

  // Those that a world could have, in the order in which they joined.
  std::vector<NodeId> fit(Precision precision) const { return members_.nodes_of(precision, required_); }
  // Those that it is to have, as far as they are there, and without those that are `unfit`.
  std::vector<NodeId> chosen(Precision precision, const std::set<NodeId>& unfit = {}) const;

  std::size_t servers_min() const;  // without which no world starts
  bool is_complete(std::size_t servers) const { return wanted_ > 0 && servers == wanted_; }

  // By rank, for a map that is made anew: those with the same labels are next to each other on the curve, so
  // that few borders lie between racks.
  std::vector<NodeId> ranked(std::vector<NodeId> nodes) const;
  // 1 for one that has been lost: the world is about to be set back.
  double capacity_of(NodeId node) const;
  std::vector<Host> hosts(const std::vector<NodeId>& nodes) const;

  // "precision f32 with the labels zone=eu, rack=a7"
  std::string described(Precision precision) const;

 private:
  const Membership& members_;
  const std::uint32_t wanted_;
  const Labels required_;
};

}  // namespace tessera
