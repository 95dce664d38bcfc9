// Shapes and exact or sampled measures of them, for the tests of the narrow phase.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "lpss/collision/collide.h"

namespace tessera::collision {

template <typename Scalar>
Matrix3<Scalar> rotation(double angle, double x, double y, double z) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d(x, y, z).normalized()).toRotationMatrix().cast<Scalar>();
}

template <typename Scalar>
Polyhedron<Scalar> cube_hull(const Vector3<Scalar>& half) {
  std::vector<Vector3<Scalar>> vertices;
  for (int n = 0; n < 8; ++n) {
    vertices.push_back(
        {n & 1 ? half.x() : -half.x(), n & 2 ? half.y() : -half.y(), n & 4 ? half.z() : -half.z()});
  }
  // Triangles, as hull computers give them.
  const std::vector<std::vector<int>> loops{{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                                            {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return *make_polyhedron<Scalar>(vertices, loops);
}

template <typename Scalar>
Polyhedron<Scalar> prism(int sides, double radius, double half_height) {
  std::vector<Vector3<Scalar>> vertices;
  std::vector<std::vector<int>> loops;
  std::vector<int> top;
  std::vector<int> bottom;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * k / sides;
    const Eigen::Vector3d p(radius * std::cos(angle), radius * std::sin(angle), half_height);
    vertices.push_back(p.cwiseProduct(Eigen::Vector3d(1, 1, -1)).cast<Scalar>());
    vertices.push_back(p.cast<Scalar>());
    const int next = (k + 1) % sides;
    loops.push_back({2 * k, 2 * next, 2 * next + 1, 2 * k + 1});
    top.push_back(2 * k + 1);
    bottom.push_back(2 * (sides - 1 - k));
  }
  loops.push_back(top);
  loops.push_back(bottom);
  return *make_polyhedron<Scalar>(vertices, loops);
}

template <typename Scalar>
Polyhedron<Scalar> tetrahedron(double size) {
  const Scalar s(static_cast<Scalar>(size));
  const std::vector<Vector3<Scalar>> vertices{{s, s, s}, {s, -s, -s}, {-s, s, -s}, {-s, -s, s}};
  const std::vector<std::vector<int>> loops{{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return *make_polyhedron<Scalar>(vertices, loops);
}

// A shape as the points around which it extends by a radius, in doubles.
struct Cloud {
  std::vector<Eigen::Vector3d> points;
  double radius = 0;

  Eigen::Vector3d support(const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d* best = &points[0];
    for (const Eigen::Vector3d& p : points) {
      if (p.dot(direction) > best->dot(direction)) best = &p;
    }
    return *best + radius * direction.normalized();
  }
  double extent() const {
    double most = 0;
    for (const Eigen::Vector3d& p : points) most = std::max(most, (p - points[0]).norm());
    return most + 2 * radius;
  }
  Cloud placed(const Eigen::Matrix3d& turn, const Eigen::Vector3d& offset) const {
    Cloud result{points, radius};
    for (Eigen::Vector3d& p : result.points) p = turn * p + offset;
    return result;
  }
};

template <typename Scalar>
Cloud cloud(const Ball<Scalar>& ball) {
  return {{Eigen::Vector3d::Zero()}, double(ball.radius)};
}
template <typename Scalar>
Cloud cloud(const Capsule<Scalar>& capsule) {
  const Eigen::Vector3d end(0, 0, double(capsule.half_length));
  return {{-end, end}, double(capsule.radius)};
}
template <typename Scalar>
Cloud cloud(const Polyhedron<Scalar>& hull) {
  Cloud result;
  for (const Vector3<Scalar>& v : hull.vertices) result.points.push_back(v.template cast<double>());
  return result;
}
template <typename Scalar>
Cloud cloud(const Box<Scalar>& box) {
  return cloud(cube_hull<Scalar>(box.half));
}
template <typename Scalar>
Cloud cloud(const MeshTriangle<Scalar>& triangle) {
  Cloud result;
  for (const Vector3<Scalar>& v : triangle.vertex) result.points.push_back(v.template cast<double>());
  return result;
}

// How far two shapes are apart along a direction from b to a; < 0: overlap.
inline double separation(const Cloud& a, const Cloud& b, const Eigen::Vector3d& normal) {
  return normal.dot(a.support(-normal) - b.support(normal));
}

// The greatest separation of all directions, to about 1e-4 of the extents: many directions, the best refined.
// It is the distance of shapes that are apart, or the least penetration.
inline double separation_max(const Cloud& a, const Cloud& b) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto direction = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  double best = -1e300;
  Eigen::Vector3d at = Eigen::Vector3d::UnitX();
  for (int start = 0; start < 12; ++start) {
    Eigen::Vector3d place = direction().normalized();
    double value = separation(a, b, place);
    for (int n = 0; n < 60; ++n) {
      const Eigen::Vector3d candidate = direction().normalized();
      if (const double other = separation(a, b, candidate); other > value) {
        value = other;
        place = candidate;
      }
    }
    for (double step = 0.5; step > 1e-5; step *= 0.8) {
      for (int n = 0; n < 6; ++n) {
        const Eigen::Vector3d candidate = (place + step * direction()).normalized();
        if (const double other = separation(a, b, candidate); other > value) {
          value = other;
          place = candidate;
        }
      }
    }
    if (value > best) {
      best = value;
      at = place;
    }
  }
  return best;
}

}  // namespace tessera::collision
