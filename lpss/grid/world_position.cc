#include "lpss/grid/world_position.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace tessera {
namespace {

constexpr char kAxisNames[] = {'x', 'y', 'z'};

__extension__ using Int128 = __int128;

// x = whole * L + rest for one component, without any rounding, and rest in [-L/2, L/2).
struct Split {
  Int128 whole = 0;
  double rest = 0;
};

// Eq. (1). Division and product round, and for an L that is not a power of two the error grows with x. The
// remainder of a rounded quotient is a double, though: both are multiples of the same unit, and it is small.
// So a fused multiply-add computes it exactly, a second quotient corrects the first one, and their sum is an
// integer.
Split split(double x, double sector_size) {
  const double half = sector_size / 2;
  if (x >= -half && x < half) return {0, x};
  const double coarse = std::rint(x / sector_size);
  const double left = std::fma(-coarse, sector_size, x);
  double fine = std::floor(left / sector_size + 0.5);
  double rest = std::fma(-fine, sector_size, left);
  if (rest < -half) {
    fine -= 1;
    rest += sector_size;
  } else if (rest >= half) {
    fine += 1;
    rest -= sector_size;
  }
  return {static_cast<Int128>(coarse) + static_cast<Int128>(fine), rest};
}

// split() for three components; refuses results that do not fit in 64 bits.
absl::Status split(const Eigen::Vector3d& x, double sector_size, SectorOffset& whole, Eigen::Vector3d& rest) {
  std::int64_t* const whole_of_axis[] = {&whole.i, &whole.j, &whole.k};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, kAxisNames[axis]);
    if (!std::isfinite(x[axis])) {
      return absl::InvalidArgumentError(absl::StrCat("position ", name, " = ", x[axis], " is not finite"));
    }
    constexpr double kLimit = 18446744073709551616.0;  // 2^64: past any result, and safe to convert
    Split parts;
    const bool convertible = std::abs(x[axis] / sector_size) < kLimit;
    if (convertible) parts = split(x[axis], sector_size);
    if (!convertible || parts.whole < std::numeric_limits<std::int64_t>::min() ||
        parts.whole > std::numeric_limits<std::int64_t>::max()) {
      return absl::OutOfRangeError(absl::StrCat("position ", name, " = ", x[axis],
                                                " m is outside the 64-bit range of sectors of ", sector_size,
                                                " m"));
    }
    *whole_of_axis[axis] = static_cast<std::int64_t>(parts.whole);
    rest[axis] = parts.rest;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<SectorOffset> sectors_from(const Eigen::Vector3d& x, double sector_size) {
  SectorOffset whole;
  Eigen::Vector3d rest;
  if (absl::Status status = split(x, sector_size, whole, rest); !status.ok()) return status;
  return whole;
}

absl::StatusOr<WorldPosition> canonical(const SectorIndex& sector, const Eigen::Vector3d& local,
                                        double sector_size) {
  SectorOffset whole;
  Eigen::Vector3d rest;
  if (absl::Status status = split(local, sector_size, whole, rest); !status.ok()) return status;
  const absl::StatusOr<SectorIndex> home = translated(sector, whole);
  if (!home.ok()) return home.status();
  return WorldPosition{*home, rest};
}

Eigen::Vector3d relative_to(const WorldPosition& point, const SectorIndex& sector, double sector_size) {
  // One rounding for product and sum together, so that the displacement a position was made from comes back
  // bit for bit.
  const Eigen::Vector3d whole = metres_between(sector, point.sector, 1);
  return {std::fma(whole.x(), sector_size, point.local.x()),
          std::fma(whole.y(), sector_size, point.local.y()),
          std::fma(whole.z(), sector_size, point.local.z())};
}

absl::StatusOr<WorldPose> compose(const WorldPose& frame, const Pose& child, double sector_size) {
  const Eigen::Vector3d local = frame.position.local + frame.orientation * child.position;
  const absl::StatusOr<WorldPosition> position = canonical(frame.position.sector, local, sector_size);
  if (!position.ok()) return position.status();
  return WorldPose{*position, (frame.orientation * child.orientation).normalized()};
}

}  // namespace tessera
