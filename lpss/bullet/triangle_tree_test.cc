#include "lpss/bullet/triangle_tree.h"

#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace tessera::bullet {
namespace {

struct Mesh {
  std::vector<btVector3> vertices;
  std::vector<int> indices;
};

// Triangles of all sizes at random places, some of them thin, and some of them the same.
Mesh random_mesh(int triangles) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-40, 40);
  std::uniform_real_distribution<double> size(-3, 3);
  Mesh mesh;
  for (int n = 0; n < triangles; ++n) {
    const double x = place(random), y = place(random), z = n % 7 == 0 ? 0 : place(random);
    for (int corner = 0; corner < 3; ++corner) {
      mesh.indices.push_back(static_cast<int>(mesh.vertices.size()));
      mesh.vertices.emplace_back(btScalar(x + size(random)), btScalar(y + size(random)),
                                 btScalar(n % 7 == 0 ? 0 : z + size(random)));
    }
    if (n % 11 == 0) mesh.indices.insert(mesh.indices.end(), mesh.indices.end() - 3, mesh.indices.end());
  }
  return mesh;
}

struct Found : btNodeOverlapCallback {
  void processNode(int part, int triangle) override {
    EXPECT_EQ(part, 0);
    triangles.push_back(triangle);
  }
  std::vector<int> sorted() {
    std::sort(triangles.begin(), triangles.end());
    return triangles;
  }
  std::vector<int> triangles;
};

std::vector<int> in_box(const btQuantizedBvh& tree, const btVector3& low, const btVector3& high) {
  Found found;
  tree.reportAabbOverlappingNodex(&found, low, high);
  return found.sorted();
}

std::vector<int> along(const btQuantizedBvh& tree, const btVector3& from, const btVector3& to) {
  Found found;
  tree.reportRayOverlappingNodex(&found, from, to);
  return found.sorted();
}

TEST(TriangleTree, FindsWhatTheTreeOfBulletFinds) {
  for (const int count : {1, 2, 3, 1000}) {
    Mesh mesh = random_mesh(count);
    const TriangleTree tree(mesh.vertices, mesh.indices);
    btIndexedMesh part;
    part.m_numTriangles = static_cast<int>(mesh.indices.size() / 3);
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(mesh.indices.data());
    part.m_triangleIndexStride = 3 * sizeof(int);
    part.m_numVertices = static_cast<int>(mesh.vertices.size());
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(mesh.vertices.data());
    part.m_vertexStride = sizeof(btVector3);
    btTriangleIndexVertexArray view;
    view.addIndexedMesh(part, PHY_INTEGER);
    btOptimizedBvh by_bullet;
    by_bullet.build(&view, /*useQuantizedAabbCompression=*/true, tree.low(), tree.high());

    std::vector<int> all(mesh.indices.size() / 3);
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(in_box(tree, tree.low(), tree.high()), all);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> place(-45, 45);
    const auto any = [&] {
      return btVector3(btScalar(place(random)), btScalar(place(random)), btScalar(place(random)));
    };
    std::size_t found = 0;
    for (int n = 0; n < 200; ++n) {
      const btVector3 low = any();
      const btVector3 high = low + btVector3(10, 10, 10);
      EXPECT_EQ(in_box(tree, low, high), in_box(by_bullet, low, high));
      const btVector3 to = any();
      EXPECT_EQ(along(tree, low, to), along(by_bullet, low, to));
      found += in_box(tree, low, high).size() + along(tree, low, to).size();
    }
    if (count == 1000) {
      EXPECT_GT(found, 500u);
    }
  }
}

TEST(TriangleTree, OfNoTriangle) {
  const std::vector<btVector3> vertices = {btVector3(0, 0, 0)};
  const TriangleTree tree(vertices, {});
  EXPECT_TRUE(in_box(tree, btVector3(-1, -1, -1), btVector3(1, 1, 1)).empty());
}

}  // namespace
}  // namespace tessera::bullet
