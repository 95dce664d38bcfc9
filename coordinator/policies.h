// Who gets what: the policies, each a function of the load.
#pragma once

#include <vector>

#include "coordinator/balance_policy.h"
#include "coordinator/cells.h"

namespace tessera {

// Who is to have each cell, so that all strains() are about the same. A function of what it is given, by
// which as few cells as may be change their owners; how many at a time is for others to bound. Of policies
// other than curve and grid, cells that cost nothing stay where they are.
std::vector<Rank> divide(BalancePolicy policy, const Division& division);

// One run of the curve a server, cut anew by cost.
std::vector<Rank> divide_curve(const Division& division);

// Each cell goes to the server whose centre is nearest, and centres to the middle of their cells, from those
// of today on (Lloyd), as in Wang et al., "A dynamic partitioning method for distributed virtual environments
// by k-means" (2009). A handicap that grows with the strain of a server makes them equal: power diagrams in
// the place of Voronoi's.
std::vector<Rank> divide_k_means(const Division& division);

// A region grows around the middle of each server's cells, over cells that share a face, always the one that
// has least by now; then neighbours even out what is left along their borders. As the convex hulls of
// Morillo, Viguera et al. (2010), whose regions keep their neighbourhoods.
std::vector<Rank> divide_hulls(const Division& division);

// Cells that share a face are a graph, which METIS cuts into parts of equal cost with short borders: Petkova
// et al. (2016). Each part goes to the server that has most of it, such that as little as possible moves.
std::vector<Rank> divide_graph(const Division& division);

// Equal boxes of the box around all cells, whatever they cost: Lozano et al. (2007), to compare with.
std::vector<Rank> divide_grid(const Division& division);

// For divide_graph(): the server of each part such that the sum of `kept[part][server]` is largest, each part
// with a server of its own; there are no more parts than servers.
std::vector<Rank> matched(const std::vector<std::vector<double>>& kept);

}  // namespace tessera
