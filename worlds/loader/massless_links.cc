#include "worlds/loader/massless_links.h"

#include <algorithm>
#include <deque>

#include "lpss/model/limits.h"

namespace tessera {

void give_least_masses(std::vector<LinkMass>& links,
                       const std::vector<std::pair<std::size_t, std::size_t>>& joints) {
  std::vector<std::vector<std::size_t>> neighbours(links.size());
  for (const auto& [a, b] : joints) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  std::deque<std::size_t> reached;
  std::vector<std::size_t> source(links.size(), links.size());  // the nearest link with a mass
  for (std::size_t n = 0; n < links.size(); ++n) {
    if (links[n].mass == 0) continue;
    source[n] = n;
    reached.push_back(n);
  }
  for (; !reached.empty(); reached.pop_front()) {
    for (const std::size_t next : neighbours[reached.front()]) {
      if (source[next] != links.size()) continue;
      source[next] = source[reached.front()];
      reached.push_back(next);
    }
  }
  for (std::size_t n = 0; n < links.size(); ++n) {
    if (source[n] == n) continue;
    if (source[n] == links.size()) {
      links[n] = {1, 1};
      continue;
    }
    const LinkMass& from = links[source[n]];
    links[n] = {std::max(kLeastMassShare * from.mass, kMassMin),
                std::max(kLeastMassShare * from.moment, kInertiaMin)};
  }
}

}  // namespace tessera
