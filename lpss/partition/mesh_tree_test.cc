#include "lpss/partition/mesh_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Triangles of all sizes, anywhere in a cube of 20 m.
TriangleMesh scattered(std::uint32_t triangles) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-10, 10);
  std::exponential_distribution<double> size(1);
  TriangleMesh mesh;
  for (std::uint32_t n = 0; n < triangles; ++n) {
    const Eigen::Vector3d centre(place(random), place(random), place(random));
    for (std::uint32_t corner = 0; corner < 3; ++corner) {
      const Eigen::Vector3d way(place(random), place(random), place(random));
      mesh.vertices.emplace_back(centre + 0.1 * size(random) * way);
      mesh.indices.push_back(3 * n + corner);
    }
  }
  return mesh;
}

TEST(MeshTree, FindsTheTrianglesThatLookingAtEachFinds) {
  const TriangleMesh mesh = scattered(500);
  const MeshTree tree(mesh);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(-12, 12);
  for (int n = 0; n < 200; ++n) {
    Eigen::AlignedBox3d wanted(Eigen::Vector3d(place(random), place(random), place(random)));
    wanted.extend(Eigen::Vector3d(place(random), place(random), place(random)));
    std::vector<std::uint32_t> expected;
    for (std::uint32_t triangle = 0; triangle < 500; ++triangle) {
      Eigen::AlignedBox3d box;
      for (std::size_t corner = 0; corner < 3; ++corner) box.extend(mesh.vertices[3 * triangle + corner]);
      if (box.intersects(wanted)) expected.push_back(triangle);
    }
    EXPECT_EQ(tree.overlapping(wanted), expected);
  }
}

TEST(MeshTree, HasNoLeastNumberOfTriangles) {
  const Eigen::AlignedBox3d all(Eigen::Vector3d::Constant(-1000), Eigen::Vector3d::Constant(1000));
  for (std::uint32_t triangles = 0; triangles < 5; ++triangles) {
    const TriangleMesh mesh = scattered(triangles);
    EXPECT_EQ(MeshTree(mesh).overlapping(all).size(), triangles);
  }
  const TriangleMesh one = scattered(1);
  EXPECT_THAT(MeshTree(one).overlapping(all), ElementsAre(0));
  EXPECT_THAT(MeshTree(one).overlapping({all.max(), 2 * all.max()}), IsEmpty());
}

}  // namespace
}  // namespace tessera
