#include <metis.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "coordinator/policies.h"
#include "coordinator/policy_centres.h"

namespace tessera {
namespace {

constexpr double kWeightOfAll = 1e8;    // of cells: METIS counts in 32 bits
constexpr idx_t kBorderMax = 1 << 16;   // between two cells, likewise
constexpr double kNever = -1e18;        // worth of a match that must not be
constexpr std::uint32_t kBisected = 8;  // up to so many parts, repeated halving cuts more evenly

// The graph in METIS's form: of each vertex, where its edges begin; their ends and weights.
struct Graph {
  std::vector<idx_t> begins = {0};
  std::vector<idx_t> ends;
  std::vector<idx_t> borders;
  std::vector<idx_t> weights;
};

Graph graph_of(const Division& division, const BusyCells& busy) {
  std::vector<idx_t> vertices(division.cells.size(), -1);
  double all = 0;
  for (std::size_t n = 0; n < busy.size(); ++n) {
    vertices[busy.cells[n]] = static_cast<idx_t>(n);
    all += division.cells[busy.cells[n]].cost;
  }
  const std::vector<std::vector<CellBorder>> neighbours = neighbours_of(division);
  Graph graph;
  for (const std::size_t cell : busy.cells) {
    for (const CellBorder& neighbour : neighbours[cell]) {
      if (vertices[neighbour.cell] < 0) continue;
      graph.ends.push_back(vertices[neighbour.cell]);
      graph.borders.push_back(static_cast<idx_t>(std::min<std::uint64_t>(neighbour.border, kBorderMax)));
    }
    graph.begins.push_back(static_cast<idx_t>(graph.ends.size()));
    graph.weights.push_back(
        std::max<idx_t>(1, static_cast<idx_t>(division.cells[cell].cost / all * kWeightOfAll)));
  }
  return graph;
}

// The part of each vertex; empty if METIS fails.
std::vector<idx_t> cut(Graph graph, const std::vector<double>& shares) {
  auto vertices = static_cast<idx_t>(graph.weights.size());
  auto parts = static_cast<idx_t>(shares.size());
  std::vector<idx_t> part(graph.weights.size());
  if (parts < 2) return part;
  if (parts == vertices) {
    std::iota(part.begin(), part.end(), idx_t{0});  // METIS prints warnings where it makes as many
    return part;
  }
  idx_t constraints = 1;
  idx_t cut_borders = 0;
  std::vector<real_t> targets(shares.begin(), shares.end());
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_NUMBERING] = 0;
  const auto method = shares.size() <= kBisected ? METIS_PartGraphRecursive : METIS_PartGraphKway;
  const int status =
      method(&vertices, &constraints, graph.begins.data(), graph.ends.data(), graph.weights.data(), nullptr,
             graph.borders.data(), &parts, targets.data(), nullptr, options, &cut_borders, part.data());
  if (status != METIS_OK) part.clear();
  return part;
}

}  // namespace

// The Hungarian method, with the smallest sum of negated values: parts are added one by one, each along the
// cheapest way of exchanges.
std::vector<Rank> matched(const std::vector<std::vector<double>>& kept) {
  if (kept.empty()) return {};
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const std::size_t parts = kept.size();
  const std::size_t servers = kept.front().size();
  // Row and column 0 are of nobody.
  std::vector<double> of_part(parts + 1);
  std::vector<double> of_server(servers + 1);
  std::vector<std::size_t> part_of(servers + 1);
  std::vector<std::size_t> came_from(servers + 1);
  for (std::size_t part = 1; part <= parts; ++part) {
    part_of[0] = part;
    std::size_t at = 0;
    std::vector<double> least(servers + 1, kFar);
    std::vector<bool> is_done(servers + 1);
    do {
      is_done[at] = true;
      const std::size_t here = part_of[at];
      double step = kFar;
      std::size_t next = 0;
      for (std::size_t server = 1; server <= servers; ++server) {
        if (is_done[server]) continue;
        const double price = -kept[here - 1][server - 1] - of_part[here] - of_server[server];
        if (price < least[server]) {
          least[server] = price;
          came_from[server] = at;
        }
        if (least[server] < step) {
          step = least[server];
          next = server;
        }
      }
      for (std::size_t server = 0; server <= servers; ++server) {
        if (is_done[server]) {
          of_part[part_of[server]] += step;
          of_server[server] -= step;
        } else {
          least[server] -= step;
        }
      }
      at = next;
    } while (part_of[at] != 0);
    for (; at != 0; at = came_from[at]) part_of[at] = part_of[came_from[at]];
  }
  std::vector<Rank> servers_of(parts);
  for (std::size_t server = 1; server <= servers; ++server) {
    if (part_of[server] > 0) servers_of[part_of[server] - 1] = static_cast<Rank>(server - 1);
  }
  return servers_of;
}

std::vector<Rank> divide_graph(const Division& division) {
  std::vector<Rank> owners;
  for (const Cell& cell : division.cells) owners.push_back(cell.owner);
  const BusyCells busy = busy_cells(division);
  if (busy.size() == 0) return owners;
  // METIS makes no more parts than there are cells.
  const std::size_t parts = std::min<std::size_t>(division.servers(), busy.size());
  std::vector<double> shares(division.parts.begin(),
                             division.parts.begin() + static_cast<std::ptrdiff_t>(parts));
  double sum = 0;
  for (const double share : shares) sum += share;
  for (double& share : shares) share /= sum;
  const std::vector<idx_t> part = cut(graph_of(division, busy), shares);
  if (part.empty()) return owners;

  // A part is for a server that is to have as much.
  std::vector<std::vector<double>> kept(parts, std::vector<double>(division.servers()));
  for (std::size_t n = 0; n < parts; ++n) {
    for (Rank rank = 0; rank < division.servers(); ++rank) {
      if (division.parts[rank] != division.parts[n]) kept[n][rank] = kNever;
    }
  }
  for (std::size_t n = 0; n < busy.size(); ++n) {
    const Cell& cell = division.cells[busy.cells[n]];
    kept[part[n]][cell.owner] += static_cast<double>(1 + cell.size());
  }
  const std::vector<Rank> servers = matched(kept);
  for (std::size_t n = 0; n < busy.size(); ++n) owners[busy.cells[n]] = servers[part[n]];
  return owners;
}

}  // namespace tessera
