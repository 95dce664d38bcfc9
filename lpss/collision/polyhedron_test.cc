#include <gtest/gtest.h>

#include "lpss/collision/shapes.h"
#include "lpss/collision/test_shapes.h"

namespace tessera::collision {
namespace {

TEST(MakePolyhedron, MergesTheTrianglesOfACube) {
  const Polyhedron<double> cube = cube_hull<double>({1, 2, 3});
  EXPECT_EQ(cube.vertices.size(), 8u);
  EXPECT_EQ(cube.faces.size(), 6u);
  EXPECT_EQ(cube.edges.size(), 12u);
  EXPECT_DOUBLE_EQ(cube.thickness, 1);
  for (const HullEdge& edge : cube.edges) {
    const Eigen::Vector3d along = cube.vertices[edge.head] - cube.vertices[edge.tail];
    EXPECT_GT(cube.planes[edge.left].normal.cross(cube.planes[edge.right].normal).dot(along), 0);
  }
}

TEST(MakePolyhedron, DropsVerticesInFacesAndEdges) {
  // A tetrahedron with a vertex in the middle of an edge and one in a face.
  const std::vector<Eigen::Vector3d> vertices{{0, 0, 0}, {2, 0, 0}, {0, 2, 0},
                                              {0, 0, 2}, {1, 0, 0}, {0.5, 0.5, 0}};
  const std::vector<std::vector<int>> loops{{0, 5, 4}, {0, 2, 5}, {2, 1, 5}, {4, 5, 1},
                                            {0, 4, 3}, {4, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const auto result = make_polyhedron<double>(vertices, loops);
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->vertices.size(), 4u);
  EXPECT_EQ(result->faces.size(), 4u);
  EXPECT_EQ(result->edges.size(), 6u);
}

TEST(MakePolyhedron, RefusesWhatIsNoConvexPolyhedron) {
  const std::vector<Eigen::Vector3d> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  EXPECT_FALSE(make_polyhedron<double>(vertices, std::vector<std::vector<int>>{}).has_value());
  // Open.
  const std::vector<std::vector<int>> open{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}};
  EXPECT_FALSE(make_polyhedron<double>(vertices, open).has_value());
  // Inside out.
  const std::vector<std::vector<int>> reversed{{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  EXPECT_FALSE(make_polyhedron<double>(vertices, reversed).has_value());
  const std::vector<std::vector<int>> closed{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  EXPECT_TRUE(make_polyhedron<double>(vertices, closed).has_value());
  // An index that is none.
  const std::vector<std::vector<int>> wrong{{0, 2, 1}, {0, 1, 4}, {0, 3, 2}, {1, 2, 3}};
  EXPECT_FALSE(make_polyhedron<double>(vertices, wrong).has_value());
}

}  // namespace
}  // namespace tessera::collision
