#include "lpss/joints/block_pattern.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <utility>

namespace tessera::joints {
namespace {

// A front takes in the one before it where the zeros among its numbers stay below this share, or below so
// many rows of pivots: dense loops over a few zeros are faster than the way from front to front.
constexpr double kZerosMax = 0.25;
constexpr int kSmallFront = 12;

std::vector<int> minimum_degree(const std::vector<std::vector<int>>& neighbours) {
  using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
  const auto count = static_cast<int>(neighbours.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (int a = 0; a < count; ++a) {
    entries.emplace_back(a, a, 1);
    for (const int b : neighbours[static_cast<std::size_t>(a)]) entries.emplace_back(b, a, 1);
  }
  Matrix matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(matrix, order);
  return {order.indices().data(), order.indices().data() + count};
}

std::vector<int> inverse(const std::vector<int>& order) {
  std::vector<int> places(order.size());
  for (std::size_t n = 0; n < order.size(); ++n)
    places[static_cast<std::size_t>(order[n])] = static_cast<int>(n);
  return places;
}

// The first later one that each fills (Liu, The role of elimination trees in sparse factorization, 1990); -1:
// none.
std::vector<int> elimination_tree(const std::vector<int>& order,
                                  const std::vector<std::vector<int>>& neighbours) {
  const std::vector<int> places = inverse(order);
  std::vector<int> parents(order.size(), -1);
  std::vector<int> ancestors(order.size(), -1);
  for (int k = 0; k < static_cast<int>(order.size()); ++k) {
    for (const int node : neighbours[static_cast<std::size_t>(order[static_cast<std::size_t>(k)])]) {
      for (int at = places[static_cast<std::size_t>(node)]; at != -1 && at < k;) {
        const auto here = static_cast<std::size_t>(at);
        at = std::exchange(ancestors[here], k);
        if (at == -1) parents[here] = k;
      }
    }
  }
  return parents;
}

// Children right before their parents.
std::vector<int> postorder(const std::vector<int>& parents) {
  const auto count = static_cast<int>(parents.size());
  std::vector<std::vector<int>> children(parents.size() + 1);  // the last: those without a parent
  for (int k = count; k-- > 0;) {
    const int parent = parents[static_cast<std::size_t>(k)];
    children[static_cast<std::size_t>(parent == -1 ? count : parent)].push_back(k);
  }
  std::vector<int> order;
  std::vector<int> stack = {count};
  while (!stack.empty()) {
    std::vector<int>& left = children[static_cast<std::size_t>(stack.back())];
    if (!left.empty()) {
      const int child = left.back();
      left.pop_back();
      stack.push_back(child);
    } else {
      if (stack.back() != count) order.push_back(stack.back());
      stack.pop_back();
    }
  }
  return order;
}

}  // namespace

BlockPattern::BlockPattern(std::vector<int> sizes, std::vector<Edge> edges)
    : sizes_(std::move(sizes)), edges_(std::move(edges)) {
  Rows neighbours(sizes_.size());
  for (const auto& [a, b] : edges_) {
    neighbours[static_cast<std::size_t>(a)].push_back(b);
    neighbours[static_cast<std::size_t>(b)].push_back(a);
  }
  const std::vector<int> nodes = order(neighbours);
  const Rows below = filled(nodes, neighbours);
  if (is_too_large_) return;
  make_fronts(nodes, below);
  place_updates();
  place_blocks();
}

BlockPattern::Rows BlockPattern::filled(const std::vector<int>& order, const Rows& neighbours) {
  const std::vector<int> places = inverse(order);
  Rows below(order.size());
  Rows children(order.size());
  std::vector<int> seen(order.size(), -1);
  double work = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const int here = static_cast<int>(k);
    double rows = sizes_[static_cast<std::size_t>(order[k])];
    const double pivots = rows;
    const auto add = [&](int place) {
      if (place <= here || seen[static_cast<std::size_t>(place)] == here) return;
      seen[static_cast<std::size_t>(place)] = here;
      below[k].push_back(place);
      rows += sizes_[static_cast<std::size_t>(order[static_cast<std::size_t>(place)])];
    };
    for (const int node : neighbours[static_cast<std::size_t>(order[k])])
      add(places[static_cast<std::size_t>(node)]);
    for (const int child : children[k]) {
      for (const int place : below[static_cast<std::size_t>(child)]) add(place);
    }
    work += pivots * rows * rows;
    is_too_large_ = work > kFactorWorkMax;
    if (is_too_large_) return below;
    std::ranges::sort(below[k]);
    if (!below[k].empty()) children[static_cast<std::size_t>(below[k].front())].push_back(here);
  }
  return below;
}

std::vector<int> BlockPattern::order(const Rows& neighbours) const {
  const std::vector<int> least_fill = minimum_degree(neighbours);
  std::vector<int> order;
  for (const int place : postorder(elimination_tree(least_fill, neighbours)))
    order.push_back(least_fill[static_cast<std::size_t>(place)]);
  return order;
}

void BlockPattern::make_fronts(const std::vector<int>& order, const Rows& below) {
  const auto size = [&](int place) {
    return sizes_[static_cast<std::size_t>(order[static_cast<std::size_t>(place)])];
  };
  struct Group {
    int first;  // node, by its place in the order
    int pivots;
    long zeros;
  };
  std::vector<Group> groups;
  std::vector<int> rows_below(order.size(), 0);
  for (std::size_t k = 0; k < order.size(); ++k) {
    for (const int place : below[k]) rows_below[k] += size(place);
    Group group{static_cast<int>(k), size(static_cast<int>(k)), 0};
    const bool is_parent =
        !groups.empty() && !below[k - 1].empty() && below[k - 1].front() == static_cast<int>(k);
    if (is_parent) {
      const Group& last = groups.back();
      const long added = group.pivots + rows_below[k] - rows_below[k - 1];
      const long zeros = last.zeros + last.pivots * added;
      const int pivots = last.pivots + group.pivots;
      const double numbers = double(pivots) * (pivots + rows_below[k]);
      if (pivots <= kSmallFront || double(zeros) <= kZerosMax * numbers) {
        group = {last.first, pivots, zeros};
        groups.pop_back();
      }
    }
    groups.push_back(group);
  }
  place_rows(order);
  front_of_.resize(order.size());
  std::vector<int> front_at(order.size());
  for (std::size_t f = 0; f < groups.size(); ++f) {
    const int end = f + 1 < groups.size() ? groups[f + 1].first : static_cast<int>(order.size());
    for (int place = groups[f].first; place < end; ++place) {
      front_at[static_cast<std::size_t>(place)] = static_cast<int>(f);
      front_of_[static_cast<std::size_t>(order[static_cast<std::size_t>(place)])] = static_cast<int>(f);
    }
    Front& front = fronts_.emplace_back();
    front.first = first_row_[static_cast<std::size_t>(order[static_cast<std::size_t>(groups[f].first)])];
    front.pivots = groups[f].pivots;
    front.panel = panels_size_;
    for (const int place : below[static_cast<std::size_t>(end - 1)]) {
      const int first = first_row_[static_cast<std::size_t>(order[static_cast<std::size_t>(place)])];
      for (int row = 0; row < size(place); ++row) front.below.push_back(first + row);
    }
    panels_size_ += static_cast<std::size_t>(front.pivots) * static_cast<std::size_t>(front.rows());
  }
  for (std::size_t f = 0; f < groups.size(); ++f) {
    const int end = f + 1 < groups.size() ? groups[f + 1].first : static_cast<int>(order.size());
    const std::vector<int>& rest = below[static_cast<std::size_t>(end - 1)];
    if (rest.empty()) continue;
    fronts_[static_cast<std::size_t>(front_at[static_cast<std::size_t>(rest.front())])].children.push_back(
        static_cast<int>(f));
  }
}

void BlockPattern::place_rows(const std::vector<int>& order) {
  std::vector<int> first_row(order.size() + 1, 0);  // by node
  for (std::size_t n = 0; n < order.size(); ++n) first_row[n + 1] = first_row[n] + sizes_[n];
  row_order_.reserve(static_cast<std::size_t>(first_row.back()));
  first_row_.resize(order.size());
  for (const int node : order) {
    const auto n = static_cast<std::size_t>(node);
    first_row_[n] = rows();
    for (int row = first_row[n]; row < first_row[n + 1]; ++row) row_order_.push_back(row);
  }
}

// Where a row of all is in a front.
namespace {

int row_in(const BlockPattern::Front& front, int row) {
  if (row < front.first + front.pivots) return row - front.first;
  const auto place = std::ranges::lower_bound(front.below, row);
  return front.pivots + static_cast<int>(place - front.below.begin());
}

}  // namespace

// On two stacks, for fronts an even and an odd number of steps below one without a parent: what a front
// leaves is written while what its children have left is read.
void BlockPattern::place_updates() {
  std::vector<bool> is_odd(fronts_.size(), false);
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    for (const int child : fronts_[f].children) is_odd[static_cast<std::size_t>(child)] = !is_odd[f];
  }
  std::array<std::size_t, 2> top = {};
  std::array<std::size_t, 2> highest = {};
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    for (const int c : front.children) {
      Front& child = fronts_[static_cast<std::size_t>(c)];
      for (int n = 0; n < child.below_count(); ++n) {
        const int to = row_in(front, child.below[static_cast<std::size_t>(n)]);
        if (!child.runs.empty() && child.runs.back().to + child.runs.back().count == to) {
          ++child.runs.back().count;
        } else {
          child.runs.push_back({n, to, 1});
        }
      }
    }
    const std::size_t stack = is_odd[f] ? 1 : 0;
    if (!front.children.empty())
      top[1 - stack] = fronts_[static_cast<std::size_t>(front.children.front())].update;
    front.update = top[stack];
    top[stack] += front.below.size() * front.below.size();
    highest[stack] = std::max(highest[stack], top[stack]);
  }
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    if (is_odd[f]) fronts_[f].update += highest[0];
  }
  updates_size_ = highest[0] + highest[1];
}

void BlockPattern::place_blocks() {
  const auto place = [&](int column, int row, bool is_transposed) {
    const Front& front = fronts_[static_cast<std::size_t>(front_of_[static_cast<std::size_t>(column)])];
    const int first = first_row_[static_cast<std::size_t>(column)] - front.first;
    const int below = row_in(front, first_row_[static_cast<std::size_t>(row)]);
    return Place{front.panel + static_cast<std::size_t>(first) * static_cast<std::size_t>(front.rows()) +
                     static_cast<std::size_t>(below),
                 front.rows(), is_transposed};
  };
  for (std::size_t node = 0; node < sizes_.size(); ++node)
    diagonals_.push_back(place(static_cast<int>(node), static_cast<int>(node), false));
  for (const auto& [a, b] : edges_) {
    const bool a_first = first_row_[static_cast<std::size_t>(a)] < first_row_[static_cast<std::size_t>(b)];
    blocks_.push_back(a_first ? place(a, b, true) : place(b, a, false));
  }
}

}  // namespace tessera::joints
