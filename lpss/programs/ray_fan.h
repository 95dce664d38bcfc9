// The directions of the rays of the program ranger, by its parameters.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>

#include "lpss/base/portable_math.h"

namespace tessera {

struct RayFan {
  static constexpr std::size_t kRaysMax = 1024;
  static constexpr double kWidest = 3;  // rad, of what is seen through a plane

  std::size_t rays = 1;  // in a row
  std::size_t rows = 1;
  double heading = 0;    // rad, of the middle of a row
  double angle = 0;      // rad, from the first to the last ray of a row; on a plane, from edge to edge
  double elevation = 0;  // rad, of the middle row
  double row_angle = 0;  // rad, from the lowest to the highest row; on a plane, from edge to edge
  bool on_plane = false;

  // Of more than kRaysMax in all, the last rows are left out.
  std::size_t count() const { return rays * std::min(rows, kRaysMax / rays); }

  // In the frame of the sensor, of unit length: x is where it looks, y to the left, z upwards. The n-th ray:
  // in a row from the right to the left, the lowest row first.
  Eigen::Vector3d direction(std::size_t n) const {
    const std::size_t row = n / rays;
    const std::size_t place = n % rays;
    if (on_plane) {
      return Eigen::Vector3d(1, half_width() * middle_of(place, rays), half_height() * middle_of(row, rows))
          .normalized();
    }
    const auto [rise, flat] = portable::sincos(angle_at(elevation, row_angle, rows, row));
    const auto [sin, cos] = portable::sincos(angle_at(heading, angle, rays, place));
    return Eigen::Vector3d(flat * cos, flat * sin, rise).normalized();
  }

  // Of the plane at a distance of 1.
  double half_width() const { return half(angle); }
  double half_height() const { return half(row_angle); }

  // Angles that are even distances apart.
  static double angle_at(double middle, double angle, std::size_t count, std::size_t n) {
    const double step = count > 1 ? angle / static_cast<double>(count - 1) : 0;
    return middle - step * static_cast<double>(count - 1) / 2 + step * static_cast<double>(n);
  }

 private:
  static double half(double angle) {
    const auto [sin, cos] = portable::sincos(std::min(angle, kWidest) / 2);
    return sin / cos;
  }
  // Of an edge from -1 to 1, the middle of its n-th part.
  static double middle_of(std::size_t n, std::size_t count) {
    return (2 * static_cast<double>(n) + 1) / static_cast<double>(count) - 1;
  }
};

}  // namespace tessera
