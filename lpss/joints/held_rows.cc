#include "lpss/joints/held_rows.h"

#include <algorithm>
#include <utility>

#include "lpss/base/invariant.h"

namespace tessera::joints {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t kPatternsKnownMax = 64;

}  // namespace

std::shared_ptr<const BlockPattern> KnownPatterns::of(const std::vector<int>& sizes,
                                                      const std::vector<BlockPattern::Edge>& edges) {
  const auto found =
      std::ranges::find_if(known_, [&](const auto& pattern) { return pattern->is_of(sizes, edges); });
  if (found != known_.end()) {
    std::rotate(found, found + 1, known_.end());
  } else {
    if (known_.size() == kPatternsKnownMax) known_.erase(known_.begin());
    known_.push_back(std::make_shared<const BlockPattern>(sizes, edges));
  }
  return known_.back();
}

void HeldRows::NodeBodies::add(Index added) {
  if (std::find(body.begin(), body.begin() + count, added) == body.begin() + count) body[count++] = added;
}

void HeldRows::set_nodes(const std::vector<NodeBodies>& bodies_of_nodes, Index bodies) {
  if (bodies == bodies_ && bodies_of_nodes == bodies_of_nodes_) return;
  bodies_ = bodies;
  bodies_of_nodes_ = bodies_of_nodes;
  nodes_.clear();
  sides_.clear();
  for (const NodeBodies& node_bodies : bodies_of_nodes) {
    Node& node = nodes_.emplace_back();
    node.sides = sides_.size();
    for (std::size_t n = 0; n < node_bodies.count; ++n)
      sides_.push_back({node_bodies.body[n], Block::Zero(), Block::Zero()});
    node.sides_end = sides_.size();
  }
  sizes_.resize(nodes_.size());
  pattern_.reset();
  make_terms(bodies);
}

void HeldRows::make_terms(Index bodies) {
  struct Tied {
    std::size_t side;
    std::size_t node;
  };
  edges_.clear();
  terms_.clear();
  std::vector<std::vector<Tied>> tied(static_cast<std::size_t>(bodies));
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    for (std::size_t s = nodes_[n].sides; s < nodes_[n].sides_end; ++s)
      tied[static_cast<std::size_t>(sides_[s].body)].push_back({s, n});
  }
  for (const std::vector<Tied>& of_body : tied) {
    for (std::size_t i = 0; i < of_body.size(); ++i) {
      for (std::size_t j = i + 1; j < of_body.size(); ++j) {
        edges_.push_back({static_cast<int>(of_body[i].node), static_cast<int>(of_body[j].node)});
        terms_.push_back({0, of_body[i].side, of_body[j].side, of_body[i].node, of_body[j].node});
      }
    }
  }
  std::ranges::sort(edges_);
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  for (Term& term : terms_) {
    const BlockPattern::Edge edge{static_cast<int>(term.node_a), static_cast<int>(term.node_b)};
    term.edge = static_cast<std::size_t>(std::ranges::lower_bound(edges_, edge) - edges_.begin());
  }
}

void HeldRows::clear() {
  for (Node& node : nodes_) node.size = 0;
}

void HeldRows::add_row(std::size_t n) {
  Node& node = nodes_[n];
  invariant(node.size < kNodeRowsMax, "a joint holds no more than six numbers");
  for (std::size_t s = node.sides; s < node.sides_end; ++s) sides_[s].rows.col(node.size).setZero();
  ++node.size;
}

void HeldRows::add(std::size_t node, Index body, const Eigen::Vector3d& linear,
                   const Eigen::Vector3d& angular) {
  const int row = nodes_[node].size - 1;
  for (std::size_t s = nodes_[node].sides; s < nodes_[node].sides_end; ++s) {
    if (sides_[s].body != body) continue;
    sides_[s].rows.col(row).head<3>() += linear;
    sides_[s].rows.col(row).tail<3>() += angular;
  }
}

bool HeldRows::factorise(const std::vector<Inertia>& inertia, double gives_way, const VectorXd& compliances,
                         KnownPatterns& patterns) {
  count_ = 0;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    nodes_[n].first = count_;
    sizes_[n] = nodes_[n].size;
    count_ += nodes_[n].size;
  }
  for (const Node& node : nodes_) {
    for (std::size_t s = node.sides; s < node.sides_end; ++s) {
      Side& side = sides_[s];
      const Inertia& body = inertia[static_cast<std::size_t>(side.body)];
      const auto rows = side.rows.leftCols(node.size);
      auto response = side.response.leftCols(node.size);
      response.topRows<3>() = body.inverse_mass * rows.topRows<3>();
      response.bottomRows<3>().noalias() = body.inverse_inertia.lazyProduct(rows.bottomRows<3>());
    }
  }
  if (pattern_ == nullptr || !pattern_->is_of(sizes_, edges_)) {
    pattern_ = patterns.of(sizes_, edges_);
    if (!pattern_->is_too_large()) factors_.set_pattern(pattern_);
  }
  if (pattern_->is_too_large()) return false;
  make_matrix();
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    BlockFactors::Block block = factors_.block(pattern_->diagonal(n), sizes_[n], sizes_[n]);
    for (int row = 0; row < sizes_[n]; ++row) {
      const Index at = nodes_[n].first + row;
      block(row, row) = diagonal_[at] * (1 + gives_way) + compliances[at];
    }
  }
  return factors_.factorise();
}

void HeldRows::make_matrix() {
  factors_.clear();
  diagonal_.resize(count_);
  const auto add = [](BlockFactors::Block block, const Side& rows, const Side& columns, bool lower_half) {
    for (Index column = 0; column < block.cols(); ++column) {
      for (Index row = lower_half ? column : 0; row < block.rows(); ++row)
        block(row, column) += rows.rows.col(row).dot(columns.response.col(column));
    }
  };
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const Node& node = nodes_[n];
    BlockFactors::Block block = factors_.block(pattern_->diagonal(n), node.size, node.size);
    for (std::size_t s = node.sides; s < node.sides_end; ++s) add(block, sides_[s], sides_[s], true);
    for (int row = 0; row < node.size; ++row) diagonal_[node.first + row] = block(row, row);
  }
  for (const Term& term : terms_) {
    const BlockPattern::Place& place = pattern_->block(term.edge);
    const std::size_t row_node = place.is_transposed ? term.node_b : term.node_a;
    const std::size_t column_node = place.is_transposed ? term.node_a : term.node_b;
    const Side& rows = sides_[place.is_transposed ? term.b : term.a];
    const Side& columns = sides_[place.is_transposed ? term.a : term.b];
    add(factors_.block(place, sizes_[row_node], sizes_[column_node]), rows, columns, false);
  }
}

}  // namespace tessera::joints
