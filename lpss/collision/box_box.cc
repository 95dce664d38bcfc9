// Boxes against boxes: 15 separating axes (Gottschalk et al., OBBTree, 1996), then the faces are clipped.

#include <array>

#include "lpss/collision/clip.h"
#include "lpss/collision/collide.h"
#include "lpss/collision/hull.h"

namespace tessera::collision {
namespace {

constexpr int kClippedMax = 8;

// Of the edges of kBoxEdges along `axis`, the one on the side of a direction.
template <typename Scalar>
int edge_towards(int axis, const Vector3<Scalar>& direction) {
  const int first = axis == 0 ? 1 : 0;
  const int second = axis == 2 ? 1 : 2;
  return 4 * axis + (direction[first] > 0 ? 1 : 0) + (direction[second] > 0 ? 2 : 0);
}

template <typename Scalar>
class BoxPair {
 public:
  using Vector = Vector3<Scalar>;
  using Matrix = Matrix3<Scalar>;

  BoxPair(const Box<Scalar>& a, const Box<Scalar>& b, const Placement<Scalar>& placement, Scalar margin)
      : a_(a.half),
        b_(b.half),
        placement_(placement),
        margin_(margin),
        rotation_(placement.a.transpose() * placement.b),
        offset_(placement.a.transpose() * placement.offset) {}

  Manifold<Scalar> collide() {
    Manifold<Scalar> manifold;
    absolute_ = rotation_.cwiseAbs();
    if (!find_faces() || !find_edges()) return manifold;
    const Scalar thickness = std::min(a_.minCoeff(), b_.minCoeff());
    const bool is_face_b = face_separation_[1] > face_separation_[0] + Scalar(kFaceBias) * thickness;
    const Scalar face_separation = face_separation_[is_face_b];
    if (edge_separation_ > face_separation + Scalar(kEdgeBias) * thickness) {
      const bool is_inside = touch_edges(manifold);
      if (is_inside || edge_separation_ <= 0) return manifold;
    } else {
      for (const bool by_b : {is_face_b, !is_face_b}) {
        clip(by_b, manifold);
        if (manifold.count > 0) return manifold;
      }
    }
    // The faces are not opposite each other: an edge or a vertex of each is what is closest.
    if (std::max({face_separation_[0], face_separation_[1], edge_separation_}) > 0) {
      find_closest(manifold);
    } else if (edge_a_ >= 0) {
      touch_edges(manifold);
    }
    return manifold;
  }

 private:
  // False if the boxes are apart by more than the margin; likewise below.
  bool find_faces() {
    for (int k = 0; k < 3; ++k) {
      const Scalar separation = std::abs(offset_[k]) - a_[k] - absolute_.row(k).dot(b_);
      if (separation > margin_) return false;
      if (separation <= face_separation_[0]) continue;
      face_separation_[0] = separation;
      face_axis_[0] = k;
    }
    back_offset_ = rotation_.transpose() * -offset_;
    for (int k = 0; k < 3; ++k) {
      const Scalar separation = std::abs(back_offset_[k]) - b_[k] - absolute_.col(k).dot(a_);
      if (separation > margin_) return false;
      if (separation <= face_separation_[1]) continue;
      face_separation_[1] = separation;
      face_axis_[1] = k;
    }
    return true;
  }

  bool find_edges() {
    constexpr Scalar kSquareMin(kParallelSine * kParallelSine);
    for (int i = 0; i < 3; ++i) {
      const int i1 = i == 2 ? 0 : i + 1;
      const int i2 = i == 0 ? 2 : i - 1;
      for (int j = 0; j < 3; ++j) {
        const int j1 = j == 2 ? 0 : j + 1;
        const int j2 = j == 0 ? 2 : j - 1;
        // Axis i of a x axis j of b has the components 0, -rotation(i2, j), rotation(i1, j) along i, i1, i2.
        const Scalar square = rotation_(i1, j) * rotation_(i1, j) + rotation_(i2, j) * rotation_(i2, j);
        const Scalar distance = std::abs(offset_[i2] * rotation_(i1, j) - offset_[i1] * rotation_(i2, j));
        const Scalar extents = a_[i1] * absolute_(i2, j) + a_[i2] * absolute_(i1, j) +
                               b_[j1] * absolute_(i, j2) + b_[j2] * absolute_(i, j1);
        const Scalar scaled = distance - extents;  // by the length of the axis
        if (square <= kSquareMin) continue;
        const Scalar separation = scaled / std::sqrt(square);
        if (separation > margin_) return false;
        if (separation <= edge_separation_) continue;
        edge_separation_ = separation;
        edge_a_ = i;
        edge_b_ = j;
      }
    }
    return true;
  }

  // In the axes of the reference, whose face is on the side of the other box.
  void clip(bool is_b_reference, Manifold<Scalar>& manifold) const {
    const Vector& reference = is_b_reference ? b_ : a_;
    const Vector& incident = is_b_reference ? a_ : b_;
    const Matrix rotation = is_b_reference ? Matrix(rotation_.transpose()) : rotation_;
    const Vector& offset = is_b_reference ? back_offset_ : offset_;
    const int axis = face_axis_[is_b_reference];
    const bool is_positive = offset[axis] >= 0;
    const int face = 2 * axis + is_positive;
    const Scalar sign = is_positive ? Scalar(1) : Scalar(-1);

    int incident_axis = 0;
    rotation.row(axis).cwiseAbs().maxCoeff(&incident_axis);
    const int incident_face = 2 * incident_axis + (rotation(axis, incident_axis) * sign < 0);

    const std::uint16_t* corner = kBoxCorners + 4 * face;
    const std::uint16_t* incident_corner = kBoxCorners + 4 * incident_face;
    const ClipNames names{corner, 4, face, incident_corner, incident_face, is_b_reference};
    ClipPolygon<Scalar, kClippedMax> buffer[2];
    buffer[0].count = 4;
    const Matrix arms = rotation * incident.asDiagonal();
    for (int n = 0; n < 4; ++n) {
      const int v = incident_corner[n];
      Vector p = offset;
      for (int k = 0; k < 3; ++k) {
        if (v >> k & 1) {
          p += arms.col(k);
        } else {
          p -= arms.col(k);
        }
      }
      buffer[0].vertex[n] = {p, names.incident_vertex(n), n};
    }

    int current = 0;
    const int first = axis == 0 ? 1 : 0;
    const int second = axis == 2 ? 1 : 2;
    const Scalar slack = Scalar(2 * kClipSlack) * std::min(reference[first], reference[second]);
    for (int side = 0; side < 4; ++side) {
      const int tail = corner[side];
      const int across = (tail ^ corner[side == 3 ? 0 : side + 1]) >> first & 1 ? second : first;
      const Scalar half = reference[across];
      const bool is_cut = tail >> across & 1
                              ? clip_side(
                                    buffer[current], side, names, slack,
                                    [=](const Vector& p) { return p[across] - half; }, buffer[1 - current])
                              : clip_side(
                                    buffer[current], side, names, slack,
                                    [=](const Vector& p) { return -p[across] - half; }, buffer[1 - current]);
      if (is_cut) current = 1 - current;
    }

    ContactPoint<Scalar> points[kClippedMax];
    int count = 0;
    manifold.normal = Vector::Zero();
    manifold.normal[axis] = is_b_reference ? sign : -sign;
    for (int n = 0; n < buffer[current].count; ++n) {
      const ClipVertex<Scalar>& v = buffer[current].vertex[n];
      const Scalar gap = sign * v.p[axis] - reference[axis];
      if (gap > margin_) continue;
      Vector on_face = v.p;
      on_face[axis] = sign * reference[axis];
      points[count++] = is_b_reference ? ContactPoint<Scalar>{v.p, on_face, gap, v.feature}
                                       : ContactPoint<Scalar>{on_face, v.p, gap, v.feature};
    }
    reduce(std::span<const ContactPoint<Scalar>>(points, count), manifold);
    turn(is_b_reference ? placement_.b : placement_.a, manifold);
    if (!is_b_reference) return;
    for (int n = 0; n < manifold.count; ++n) {
      manifold.point[n].on_a += placement_.offset;
      manifold.point[n].on_b += placement_.offset;
    }
  }

  // Returns whether the points are between the ends of the edges.
  bool touch_edges(Manifold<Scalar>& manifold) const {
    Vector out = Vector::Unit(edge_a_).cross(rotation_.col(edge_b_)).normalized();
    if (out.dot(offset_) < 0) out = -out;
    const int edge_a = edge_towards(edge_a_, out);
    const int edge_b = edge_towards(edge_b_, Vector(rotation_.transpose() * -out));
    const Vector tail_a = box_vertex(a_, kBoxEdges[edge_a].tail);
    const Vector tail_b = rotation_ * box_vertex(b_, kBoxEdges[edge_b].tail) + offset_;
    const ClosestSegments<Scalar> closest(tail_a, Vector(2 * a_[edge_a_] * Vector::Unit(edge_a_)), tail_b,
                                          Vector(2 * b_[edge_b_] * rotation_.col(edge_b_)));
    manifold.normal = -out;
    manifold.count = 1;
    manifold.point[0] = {closest.on_a, closest.on_b, (closest.on_b - closest.on_a).dot(out),
                         make_feature(Touch::kEdges, edge_a, edge_b)};
    turn(placement_.a, manifold);
    return closest.is_inside();
  }

  void find_closest(Manifold<Scalar>& manifold) const {
    std::array<Vector, 8> vertices_a;
    std::array<Vector, 8> vertices_b;
    for (int n = 0; n < 8; ++n) {
      vertices_a[n] = box_vertex(a_, n);
      vertices_b[n] = rotation_ * box_vertex(b_, n) + offset_;
    }
    closest_edges<Scalar>({vertices_a, kBoxEdges}, {vertices_b, kBoxEdges},
                          Vector(placement_.a.transpose() * manifold.normal), margin_, manifold);
    turn(placement_.a, manifold);
  }

  const Vector& a_;
  const Vector& b_;
  const Placement<Scalar>& placement_;
  Scalar margin_;
  Matrix rotation_;  // from b's axes to a's
  Vector offset_;    // of b's centre, in a's axes
  Matrix absolute_;
  Vector back_offset_;  // of a's centre, in b's axes
  // The best axes: of faces of a and b, and of an axis of each.
  int face_axis_[2] = {0, 0};
  Scalar face_separation_[2] = {std::numeric_limits<Scalar>::lowest(), std::numeric_limits<Scalar>::lowest()};
  int edge_a_ = -1;
  int edge_b_ = -1;
  Scalar edge_separation_ = std::numeric_limits<Scalar>::lowest();
};

}  // namespace

template <typename Scalar>
Manifold<Scalar> collide(const Box<Scalar>& a, const Box<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin) {
  return BoxPair<Scalar>(a, b, placement, margin).collide();
}

template Manifold<float> collide(const Box<float>&, const Box<float>&, const Placement<float>&, float);
template Manifold<double> collide(const Box<double>&, const Box<double>&, const Placement<double>&, double);

}  // namespace tessera::collision
