#include "lpss/bullet/triangle_tree.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace tessera::bullet {
namespace {

// As build() has them: thinner boxes become this much thicker on both sides.
constexpr btScalar kThin = btScalar(0.002);       // m
constexpr btScalar kThickened = btScalar(0.001);  // m

// Bit n of 16 becomes bit 3 n.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 16) & 0x0000'0000'ff00'00ff;
  bits = (bits | bits << 8) & 0x0000'00f0'0f00'f00f;
  bits = (bits | bits << 4) & 0x0000'0c30'c30c'30c3;
  return (bits | bits << 2) & 0x0000'2492'4924'9249;
}

}  // namespace

TriangleTree::TriangleTree(std::span<const btVector3> vertices, std::span<const int> indices)
    : low_(vertices.front()), high_(vertices.front()) {
  for (const btVector3& vertex : vertices) {
    low_.setMin(vertex);
    high_.setMax(vertex);
  }
  setQuantizationValues(low_, high_);
  std::vector<btQuantizedBvhNode> leaves;
  leaves.reserve(indices.size() / 3);
  for (std::size_t n = 0; n + 2 < indices.size(); n += 3) {
    const auto corner = [&](std::size_t k) { return vertices[static_cast<std::size_t>(indices[n + k])]; };
    leaves.push_back(leaf({corner(0), corner(1), corner(2)}, static_cast<int>(leaves.size())));
  }
  m_curNodeIndex = 0;
  if (leaves.empty()) return;
  m_quantizedContiguousNodes.resize(2 * static_cast<int>(leaves.size()) - 1);
  add(along_curve(leaves));
}

btQuantizedBvhNode TriangleTree::leaf(const btVector3 (&corners)[3], int triangle) const {
  btVector3 low = corners[0];
  btVector3 high = corners[0];
  for (const btVector3& corner : corners) {
    low.setMin(corner);
    high.setMax(corner);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (high[axis] - low[axis] >= kThin) continue;
    high[axis] += kThickened;
    low[axis] -= kThickened;
  }
  btQuantizedBvhNode node;
  quantize(node.m_quantizedAabbMin, low, 0);
  quantize(node.m_quantizedAabbMax, high, 1);
  node.m_escapeIndexOrTriangleIndex = triangle;  // of part 0
  return node;
}

std::vector<btQuantizedBvhNode> TriangleTree::along_curve(std::span<const btQuantizedBvhNode> leaves) const {
  // From twice a middle to cells of the curve, 2^16 along the longest axis and as long along the others.
  const btVector3 size = m_bvhAabbMax - m_bvhAabbMin;
  const btVector3 cells = size * (1 / (2 * size[size.maxAxis()]));
  std::vector<std::pair<std::uint64_t, std::uint32_t>> places;
  places.reserve(leaves.size());
  for (const btQuantizedBvhNode& leaf : leaves) {
    std::uint64_t place = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int middle = int{leaf.m_quantizedAabbMin[axis]} + int{leaf.m_quantizedAabbMax[axis]};
      place |= spread(static_cast<std::uint64_t>(btScalar(middle) * cells[axis])) << axis;
    }
    places.emplace_back(place, static_cast<std::uint32_t>(places.size()));
  }
  std::ranges::sort(places);
  std::vector<btQuantizedBvhNode> sorted;
  sorted.reserve(leaves.size());
  for (const auto& [place, leaf] : places) sorted.push_back(leaves[leaf]);
  return sorted;
}

int TriangleTree::add(std::span<const btQuantizedBvhNode> leaves) {
  const int place = m_curNodeIndex++;
  btQuantizedBvhNode& node = m_quantizedContiguousNodes[place];
  if (leaves.size() == 1) {
    node = leaves.front();
    return place;
  }
  const std::size_t half = leaves.size() / 2;
  const btQuantizedBvhNode& left = m_quantizedContiguousNodes[add(leaves.first(half))];
  const btQuantizedBvhNode& right = m_quantizedContiguousNodes[add(leaves.subspan(half))];
  for (int k = 0; k < 3; ++k) {
    node.m_quantizedAabbMin[k] = std::min(left.m_quantizedAabbMin[k], right.m_quantizedAabbMin[k]);
    node.m_quantizedAabbMax[k] = std::max(left.m_quantizedAabbMax[k], right.m_quantizedAabbMax[k]);
  }
  node.m_escapeIndexOrTriangleIndex = -(m_curNodeIndex - place);
  return place;
}

}  // namespace tessera::bullet
