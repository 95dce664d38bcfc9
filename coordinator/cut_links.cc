#include "coordinator/cut_links.h"

#include <algorithm>
#include <map>
#include <set>

namespace tessera {

std::vector<NodeId> servers_to_drop(std::span<const CutLink> links) {
  std::map<NodeId, std::set<NodeId>> cut_from;
  for (const CutLink& link : links) {
    cut_from[link.waits].insert(link.awaited);
    cut_from[link.awaited].insert(link.waits);
  }
  std::vector<NodeId> dropped;
  while (!cut_from.empty()) {
    // Ascending nodes: the last of those with most links.
    auto worst = cut_from.begin();
    for (auto server = cut_from.begin(); server != cut_from.end(); ++server) {
      if (server->second.size() >= worst->second.size()) worst = server;
    }
    const NodeId node = worst->first;
    cut_from.erase(worst);
    dropped.push_back(node);
    for (auto& [other, peers] : cut_from) peers.erase(node);
    std::erase_if(cut_from, [](const auto& server) { return server.second.empty(); });
  }
  std::ranges::sort(dropped);
  return dropped;
}

}  // namespace tessera
