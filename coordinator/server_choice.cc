#include "coordinator/server_choice.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>

#include "lpss/base/invariant.h"
#include "proto/convert.h"

namespace tessera {

std::vector<NodeId> ServerChoice::chosen(Precision precision, const std::set<NodeId>& unfit) const {
  std::vector<NodeId> nodes = fit(precision);
  if (wanted_ > 0 && nodes.size() > wanted_) nodes.resize(wanted_);
  std::erase_if(nodes, [&](NodeId node) { return unfit.contains(node); });
  return nodes;
}

std::size_t ServerChoice::servers_min() const { return std::max<std::size_t>(wanted_, 1); }

std::vector<NodeId> ServerChoice::ranked(std::vector<NodeId> nodes) const {
  std::ranges::stable_sort(nodes, {}, [&](NodeId node) -> const Labels& {
    const Server* server = members_.find(node);
    invariant(server != nullptr, "servers are chosen among the members");
    return server->labels;
  });
  return nodes;
}

double ServerChoice::capacity_of(NodeId node) const {
  const Server* server = members_.find(node);
  return server == nullptr ? 1 : server->capacity;
}

std::vector<Host> ServerChoice::hosts(const std::vector<NodeId>& nodes) const {
  std::vector<Host> hosts;
  for (const NodeId node : nodes) hosts.push_back({node, capacity_of(node)});
  return hosts;
}

std::string ServerChoice::described(Precision precision) const {
  return absl::StrCat("precision ", name_of(precision), required_.empty() ? "" : " with the labels ",
                      absl::StrJoin(required_, ", "));
}

}  // namespace tessera
