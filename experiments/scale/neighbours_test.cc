// What a server has to do with others does not grow with their number.
#include "experiments/scale/neighbours.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(Neighbours, AServersMessagesDoNotGrowWithTheServers) {
  const auto run = [](Layout layout, int servers) {
    const auto result = run_neighbours(neighbours_world(layout, servers, Precision::kFloat32),
                                       static_cast<std::uint32_t>(servers), 1, 20, [] { return true; });
    EXPECT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->hash, result->hash_of_one) << servers;
    return *result;
  };
  const NeighboursRun few = run(Layout::kRow, 16);
  const NeighboursRun many = run(Layout::kRow, 32);
  EXPECT_LT(many.messages.mean, 1.1 * few.messages.mean);
  EXPECT_LT(many.bytes.mean, 1.1 * few.bytes.mean);
  EXPECT_LT(many.messages.largest, 1.1 * few.messages.largest);
  run(Layout::kPlane, 8);
  const NeighboursRun jointed = run(Layout::kJointedRow, 16);
  EXPECT_EQ(jointed.joints.largest, 2 * kSectorsPerServer + 1);
}

TEST(Neighbours, EndWhereTheyAreTo) {
  const auto run =
      run_neighbours(neighbours_world(Layout::kRow, 2, Precision::kFloat32), 2, 8, 10, [] { return false; });
  EXPECT_TRUE(absl::IsCancelled(run.status()));
}

}  // namespace
}  // namespace tessera
