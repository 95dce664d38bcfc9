// The held rows of an assembly, and what solves them at once: the factors of J M^-1 J^T, with J the rows and
// M the masses of the bodies.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "lpss/joints/block_factors.h"
#include "lpss/joints/block_pattern.h"
#include "lpss/joints/joint_rows.h"

namespace tessera::joints {

// The patterns of the systems solved last: they stay the same from tick to tick.
class KnownPatterns {
 public:
  std::shared_ptr<const BlockPattern> of(const std::vector<int>& sizes,
                                         const std::vector<BlockPattern::Edge>& edges);

 private:
  std::vector<std::shared_ptr<const BlockPattern>> known_;  // the one used last comes last
};

// Vectors are of all velocities, by body, or of all rows, by node.
class HeldRows {
 public:
  // A node is a joint or a coupling: rows on the same bodies, each of which is named once.
  struct NodeBodies {
    std::array<Eigen::Index, 4> body = {};
    std::size_t count = 0;

    void add(Eigen::Index added);  // unless it is there
    friend bool operator==(const NodeBodies&, const NodeBodies&) = default;
  };

  // Does nothing where they are as before: an assembly is the same from tick to tick.
  void set_nodes(const std::vector<NodeBodies>& bodies_of_nodes, Eigen::Index bodies);

  // Begins new rows: at most kNodeRowsMax of each node, in the order of nodes.
  void clear();
  void add_row(std::size_t node);
  // To the last row of a node: what it is on one of the node's bodies.
  void add(std::size_t node, Eigen::Index body, const Eigen::Vector3d& linear,
           const Eigen::Vector3d& angular);

  // With the inertia of each body. A row gives way by a share of what holds it, and by its compliance.
  // False if the rows have no solution.
  bool factorise(const std::vector<Inertia>& inertia, double gives_way, const Eigen::VectorXd& compliances,
                 KnownPatterns& patterns);

  // Of J M^-1 J^T alone.
  const Eigen::VectorXd& diagonal() const { return diagonal_; }
  Eigen::Index count() const { return count_; }

  // Numbers are an Eigen::VectorXd, or several side by side (Sides). The argument `into` is another one, of
  // any size before.
  template <typename Numbers>
  void solve(const Numbers& of_rows, Numbers& into) const {
    factors_.solve(of_rows, into);
  }

  // J v
  template <typename Numbers>
  void rates(const Numbers& velocities, Numbers& into) const {
    along<&Side::rows>(velocities, into);
  }
  // J M^-1 v
  template <typename Numbers>
  void answers(const Numbers& row, Numbers& into) const {
    along<&Side::response>(row, into);
  }
  // J^T i
  template <typename Numbers>
  void row(const Numbers& of_rows, Numbers& into) const {
    combined<&Side::rows>(of_rows, into);
  }
  // M^-1 J^T i
  template <typename Numbers>
  void response(const Numbers& impulses, Numbers& into) const {
    combined<&Side::response>(impulses, into);
  }

  static constexpr int kNodeRowsMax = kHeldRowsMax;

 private:
  using Block = Eigen::Matrix<double, kBodyNumbers, kNodeRowsMax>;

  // The rows of a node on one body, as columns, and how that answers to a unit of impulse of each.
  struct Side {
    Eigen::Index body;
    Block rows;
    Block response;
  };

  struct Node {
    Eigen::Index first = 0;  // row
    int size = 0;            // rows
    std::size_t sides = 0;   // the first one
    std::size_t sides_end = 0;
  };

  // Two sides on one body: what they add to the block of their nodes.
  struct Term {
    std::size_t edge;
    std::size_t a;  // sides; of the edge's nodes
    std::size_t b;
    std::size_t node_a;
    std::size_t node_b;
  };

  // Calls act(row) for the rows of a node, with constants: most joints hold three or five.
  template <typename Act>
  static EIGEN_STRONG_INLINE void for_each_row(const Node& node, const Act& act) {
    const auto first = [&]<int... kRow>(std::integer_sequence<int, kRow...>) { (act(kRow), ...); };
    switch (node.size) {
      case 3:
        return first(std::make_integer_sequence<int, 3>());
      case 5:
        return first(std::make_integer_sequence<int, 5>());
      case 6:
        return first(std::make_integer_sequence<int, 6>());
      default:
        for (int row = 0; row < node.size; ++row) act(row);
    }
  }

  void make_terms(Eigen::Index bodies);
  void make_matrix();
  template <Block Side::*kPart>
  void along(const Eigen::VectorXd& velocities, Eigen::VectorXd& rates) const;
  template <Block Side::*kPart>
  void along(const Sides& velocities, Sides& rates) const;
  template <Block Side::*kPart>
  void combined(const Eigen::VectorXd& of_rows, Eigen::VectorXd& sum) const;
  template <Block Side::*kPart>
  void combined(const Sides& of_rows, Sides& sum) const;

  const BlockKernel& kernel_ = *block_kernels().back();
  std::vector<NodeBodies> bodies_of_nodes_;
  std::vector<Node> nodes_;
  std::vector<Side> sides_;
  std::vector<BlockPattern::Edge> edges_;
  std::vector<Term> terms_;
  std::vector<int> sizes_;  // of nodes
  Eigen::Index bodies_ = 0;
  Eigen::Index count_ = 0;
  std::shared_ptr<const BlockPattern> pattern_;
  BlockFactors factors_;
  Eigen::VectorXd diagonal_;
};

template <HeldRows::Block HeldRows::Side::*kPart>
void HeldRows::along(const Eigen::VectorXd& velocities, Eigen::VectorXd& rates) const {
  rates.setZero(count_);
  for (const Node& node : nodes_) {
    for (std::size_t s = node.sides; s < node.sides_end; ++s) {
      const Side& side = sides_[s];
      const Eigen::Matrix<double, kBodyNumbers, 1> velocity =
          velocities.segment<kBodyNumbers>(kBodyNumbers * side.body);
      for_each_row(node, [&](int row) { rates[node.first + row] += (side.*kPart).col(row).dot(velocity); });
    }
  }
}

template <HeldRows::Block HeldRows::Side::*kPart>
void HeldRows::along(const Sides& velocities, Sides& rates) const {
  rates.setZero(count_, kSidesAtOnce);
  for (const Node& node : nodes_) {
    for (std::size_t s = node.sides; s < node.sides_end; ++s) {
      const Side& side = sides_[s];
      kernel_.add_rates_of_sides((side.*kPart).data(), node.size,
                                 velocities.data() + kBodyNumbers * kSidesAtOnce * side.body,
                                 rates.data() + kSidesAtOnce * node.first);
    }
  }
}

template <HeldRows::Block HeldRows::Side::*kPart>
void HeldRows::combined(const Eigen::VectorXd& of_rows, Eigen::VectorXd& sum) const {
  sum.setZero(kBodyNumbers * bodies_);
  for (const Node& node : nodes_) {
    for (std::size_t s = node.sides; s < node.sides_end; ++s) {
      const Side& side = sides_[s];
      auto into = sum.segment<kBodyNumbers>(kBodyNumbers * side.body);
      Eigen::Matrix<double, kBodyNumbers, 1> of_body = into;
      for_each_row(node, [&](int row) { of_body += (side.*kPart).col(row) * of_rows[node.first + row]; });
      into = of_body;
    }
  }
}

template <HeldRows::Block HeldRows::Side::*kPart>
void HeldRows::combined(const Sides& of_rows, Sides& sum) const {
  sum.setZero(kBodyNumbers * bodies_, kSidesAtOnce);
  for (const Node& node : nodes_) {
    for (std::size_t s = node.sides; s < node.sides_end; ++s) {
      const Side& side = sides_[s];
      kernel_.add_combined_of_sides((side.*kPart).data(), node.size,
                                    of_rows.data() + kSidesAtOnce * node.first,
                                    sum.data() + kBodyNumbers * kSidesAtOnce * side.body);
    }
  }
}

}  // namespace tessera::joints
