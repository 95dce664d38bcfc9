// Clipping of a convex polygon (incident) against the sides of another (reference), side by side (Sutherland
// and Hodgman), with the features of what is left.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>

#include "lpss/collision/manifold.h"

namespace tessera::collision {

// A vertex that is outside by less than this share of the shortest side counts as inside, and keeps its
// feature: faces that cover each other exactly give the same points in spite of rounding.
inline constexpr double kClipSlack = 5e-4;

template <typename Scalar>
struct ClipVertex {
  Vector3<Scalar> p;
  std::uint32_t feature;
  int edge;  // what the polygon follows from here: an edge of the incident polygon or kSide + a side
};
inline constexpr int kSide = 1 << 16;

template <typename Scalar, int kMax>
struct ClipPolygon {
  int count = 0;
  ClipVertex<Scalar> vertex[kMax];

  void add(const ClipVertex<Scalar>& v) {
    if (count < kMax) vertex[count++] = v;
  }
};

// What the corners of two polygons are called.
struct ClipNames {
  const std::uint16_t* reference;  // ids of vertices
  int sides;
  int reference_face;
  const std::uint16_t* incident;
  int incident_face;
  bool is_b_reference;

  std::uint32_t incident_vertex(int n) const {
    return is_b_reference ? make_feature(Touch::kVertexA, incident[n], reference_face)
                          : make_feature(Touch::kVertexB, reference_face, incident[n]);
  }

  // Where a line (ClipVertex::edge) meets a side. Side n goes from vertex n to n + 1.
  std::uint32_t crossing(int edge, int side) const {
    if (edge < kSide) {
      return is_b_reference ? make_feature(Touch::kCrossing, incident[edge], reference[side])
                            : make_feature(Touch::kCrossing, reference[side], incident[edge]);
    }
    const int other = edge - kSide;
    const int vertex = (other + 1) % sides == side ? side : other;
    return is_b_reference ? make_feature(Touch::kVertexB, incident_face, reference[vertex])
                          : make_feature(Touch::kVertexA, reference[vertex], incident_face);
  }
};

// Clips `in` to where distance(p) <= 0, into `out`; returns whether anything is cut off, else `out` is not
// used.
template <typename Scalar, int kMax, typename Distance>
bool clip_side(const ClipPolygon<Scalar, kMax>& in, int side, const ClipNames& names, Scalar slack,
               const Distance& distance, ClipPolygon<Scalar, kMax>& out) {
  Scalar height[kMax];
  bool is_cut = false;
  for (int n = 0; n < in.count; ++n) {
    height[n] = distance(in.vertex[n].p);
    is_cut = is_cut || height[n] > slack;
  }
  if (!is_cut) return false;

  out.count = 0;
  for (int n = 0; n < in.count; ++n) {
    const int m = n + 1 < in.count ? n + 1 : 0;
    const ClipVertex<Scalar>& from = in.vertex[n];
    const bool is_from_inside = height[n] <= slack;
    const bool is_to_inside = height[m] <= slack;
    if (is_from_inside) out.add(from);
    if (is_from_inside == is_to_inside) continue;
    // A vertex in the slack is its own crossing.
    if (is_from_inside && height[n] >= 0) {
      out.vertex[out.count - 1].edge = kSide + side;
    } else if (is_from_inside || height[m] < 0) {
      const Scalar t = height[n] / (height[n] - height[m]);
      out.add({from.p + t * (in.vertex[m].p - from.p), names.crossing(from.edge, side),
               is_from_inside ? kSide + side : from.edge});
    }
  }
  return true;
}

}  // namespace tessera::collision
