#include "lpss/joints/small_system.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera::joints {
namespace {

TEST(SmallSystem, SolvesTheChosenRows) {
  std::mt19937 random(1);
  std::normal_distribution<double> number;
  const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(6, 6, [&] { return number(random); });
  const Eigen::MatrixXd matrix = root * root.transpose();
  const std::vector<int> chosen = {0, 2, 3, 5};
  SmallSystem system;
  system.factorise(matrix, chosen);
  std::vector<double> x = {1, -2, 3, -4};
  const std::vector<double> b = x;
  system.solve(x);
  for (std::size_t row = 0; row < 4; ++row) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += matrix(chosen[row], chosen[k]) * x[k];
    EXPECT_NEAR(sum, b[row], 1e-9);
  }
}

TEST(SmallSystem, LeavesOutWhatFollowsFromOthers) {
  Eigen::Matrix3d matrix;
  matrix << 2, 2, 0, 2, 2, 0, 0, 0, 4;
  SmallSystem system;
  system.factorise(matrix, std::vector<int>{0, 1, 2});
  std::vector<double> x = {2, 2, 8};
  system.solve(x);
  EXPECT_NEAR(x[0], 1, 1e-15);
  EXPECT_EQ(x[1], 0);
  EXPECT_EQ(x[2], 2);
}

}  // namespace
}  // namespace tessera::joints
