#include "lpss/joints/block_factors.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace tessera::joints {
namespace {

using Edges = std::vector<BlockPattern::Edge>;

struct Graph {
  std::string name;
  int nodes;
  Edges edges;

  friend void PrintTo(const Graph& graph, std::ostream* out) { *out << graph.name; }
};

Graph graph_of(std::string name, int nodes, Edges edges) {
  for (auto& [a, b] : edges) {
    if (a > b) std::swap(a, b);
  }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return {std::move(name), nodes, std::move(edges)};
}

Graph chain(int nodes) {
  Edges edges;
  for (int n = 1; n < nodes; ++n) edges.push_back({n - 1, n});
  return graph_of("Chain", nodes, edges);
}

Graph star(int nodes) {
  Edges edges;
  for (int n = 1; n < nodes; ++n) edges.push_back({0, n});
  return graph_of("Star", nodes, edges);
}

Graph grid(int side) {
  Edges edges;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      if (i > 0) edges.push_back({side * (i - 1) + j, side * i + j});
      if (j > 0) edges.push_back({side * i + j - 1, side * i + j});
    }
  }
  return graph_of("Grid", side * side, edges);
}

Graph all_to_all(int nodes) {
  Edges edges;
  for (int a = 0; a < nodes; ++a) {
    for (int b = a + 1; b < nodes; ++b) edges.push_back({a, b});
  }
  return graph_of("AllToAll", nodes, edges);
}

// Some of them in parts that nothing connects.
Graph at_random(unsigned seed) {
  std::mt19937 random(seed);
  const int nodes = 1 + static_cast<int>(random() % 60);
  Edges edges;
  for (unsigned n = random() % 120; n > 0; --n) {
    const int a = static_cast<int>(random() % static_cast<unsigned>(nodes));
    const int b = static_cast<int>(random() % static_cast<unsigned>(nodes));
    if (a != b) edges.push_back({a, b});
  }
  return graph_of("AtRandom" + std::to_string(seed), nodes, edges);
}

std::vector<Graph> graphs() {
  std::vector<Graph> graphs = {chain(1), chain(2), chain(50), star(30), grid(9), all_to_all(12)};
  graphs[0].name = "One";
  graphs[1].name = "Two";
  for (unsigned seed = 0; seed < 20; ++seed) graphs.push_back(at_random(seed));
  return graphs;
}

// A matrix of blocks of 1 to 6 rows on a graph, whose diagonal makes it positive definite.
struct System {
  explicit System(const Graph& graph, unsigned seed) : edges(graph.edges) {
    std::mt19937 random(seed);
    std::vector<int> first;
    int rows = 0;
    for (int n = 0; n < graph.nodes; ++n) {
      first.push_back(rows);
      sizes.push_back(1 + static_cast<int>(random() % 6));
      rows += sizes.back();
    }
    first_row = first;
    matrix = Eigen::MatrixXd::Zero(rows, rows);
    std::uniform_real_distribution<double> number(-1, 1);
    const auto fill = [&](int a, int b) {
      for (int i = 0; i < sizes[static_cast<std::size_t>(a)]; ++i) {
        for (int j = 0; j < sizes[static_cast<std::size_t>(b)]; ++j) {
          const int row = first[static_cast<std::size_t>(a)] + i;
          const int column = first[static_cast<std::size_t>(b)] + j;
          matrix(row, column) = matrix(column, row) = number(random);
        }
      }
    };
    for (int n = 0; n < graph.nodes; ++n) fill(n, n);
    for (const auto& [a, b] : edges) fill(a, b);
    for (int row = 0; row < rows; ++row) matrix(row, row) = 0.5 + matrix.row(row).cwiseAbs().sum();
  }

  BlockFactors factors(const std::shared_ptr<const BlockPattern>& pattern,
                       const BlockKernel& kernel = *block_kernels().back()) const {
    BlockFactors result(kernel);
    result.set_pattern(pattern);
    result.clear();
    const auto block = [&](int a, int b) {
      const auto m = static_cast<std::size_t>(a);
      const auto n = static_cast<std::size_t>(b);
      return matrix.block(first_row[m], first_row[n], sizes[m], sizes[n]);
    };
    for (int n = 0; n < static_cast<int>(sizes.size()); ++n) {
      const int size = sizes[static_cast<std::size_t>(n)];
      result.block(pattern->diagonal(static_cast<std::size_t>(n)), size, size) = block(n, n);
    }
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const BlockPattern::Place& place = pattern->block(e);
      const int row = place.is_transposed ? edges[e].b : edges[e].a;
      const int column = place.is_transposed ? edges[e].a : edges[e].b;
      result.block(place, sizes[static_cast<std::size_t>(row)], sizes[static_cast<std::size_t>(column)]) =
          block(row, column);
    }
    return result;
  }

  std::vector<int> sizes;
  Edges edges;
  std::vector<int> first_row;
  Eigen::MatrixXd matrix;
};

class BlockFactorsTest : public testing::TestWithParam<Graph> {};

TEST_P(BlockFactorsTest, SolvesAsADenseFactorisation) {
  const System system(GetParam(), 7);
  const auto pattern = std::make_shared<const BlockPattern>(system.sizes, system.edges);
  BlockFactors factors = system.factors(pattern);
  ASSERT_TRUE(factors.factorise());
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(system.matrix.rows(), -1, 2);
  const Eigen::VectorXd expected = system.matrix.ldlt().solve(right);
  Eigen::VectorXd solution;
  factors.solve(right, solution);
  EXPECT_LT((solution - expected).lpNorm<Eigen::Infinity>(), 1e-12);
}

TEST_P(BlockFactorsTest, HasTheSameBitsOnAllProcessorsAndSideBySide) {
  const System system(GetParam(), 9);
  const auto pattern = std::make_shared<const BlockPattern>(system.sizes, system.edges);
  Sides right(system.matrix.rows(), kSidesAtOnce);
  for (Eigen::Index n = 0; n < right.size(); ++n) right.data()[n] = std::cos(static_cast<double>(n));
  Sides expected(right.rows(), kSidesAtOnce);
  for (const BlockKernel* kernel : block_kernels()) {
    BlockFactors factors = system.factors(pattern, *kernel);
    ASSERT_TRUE(factors.factorise());
    Sides solution;
    factors.solve(right, solution);
    for (Eigen::Index side = 0; side < kSidesAtOnce; ++side) {
      Eigen::VectorXd alone;
      factors.solve(right.col(side), alone);
      EXPECT_EQ(solution.col(side), alone);
    }
    if (kernel == block_kernels().front()) expected = solution;
    EXPECT_EQ(solution, expected);
  }
}

TEST_P(BlockFactorsTest, FindsASingularMatrix) {
  System system(GetParam(), 8);
  system.matrix.row(0).setZero();
  system.matrix.col(0).setZero();
  const auto pattern = std::make_shared<const BlockPattern>(system.sizes, system.edges);
  EXPECT_FALSE(system.factors(pattern).factorise());
}

INSTANTIATE_TEST_SUITE_P(Graphs, BlockFactorsTest, testing::ValuesIn(graphs()),
                         testing::PrintToStringParamName());

TEST(BlockPattern, AChainFillsNothing) {
  const BlockPattern pattern(std::vector<int>(1000, 6), chain(1000).edges);
  EXPECT_LT(pattern.panels_size(), 1000u * 6 * 6 * 4);
}

TEST(BlockPattern, WhatWouldTakeTooLongIsLeftOut) {
  const Graph mesh = grid(100);
  EXPECT_FALSE(BlockPattern(std::vector<int>(10'000, 3), mesh.edges).is_too_large());
  EXPECT_FALSE(BlockPattern(std::vector<int>(600, 3), all_to_all(600).edges).is_too_large());
  const BlockPattern dense(std::vector<int>(900, 3), all_to_all(900).edges);
  EXPECT_TRUE(dense.is_too_large());
  EXPECT_EQ(dense.panels_size(), 0u) << "nothing is reserved for it";
}

TEST(BlockPattern, AGridFillsLittle) {
  const BlockPattern pattern(std::vector<int>(1600, 3), grid(40).edges);
  EXPECT_LT(pattern.panels_size(), 1'000'000u);
}

}  // namespace
}  // namespace tessera::joints
