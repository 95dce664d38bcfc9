#include "worlds/loader/geodesy.h"

#include <absl/strings/str_cat.h>

#include <cmath>

#include "lpss/base/portable_math.h"

namespace tessera {
namespace {

// WGS84.
constexpr double kEquatorialRadius = 6378137;  // m
constexpr double kFlattening = 1 / 298.257223563;
constexpr double kEccentricitySquared = kFlattening * (2 - kFlattening);

absl::Status within(const char* what, double value, double least, double most, const char* unit) {
  if (std::isfinite(value) && value >= least && value <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(what, " = ", value, " must be ", least, " to ", most, " ", unit));
}

}  // namespace

absl::StatusOr<WorldPose> site_frame(double latitude, double longitude, double height, SiteUp up,
                                     double sector_size) {
  if (absl::Status status = within("latitude", latitude, -90, 90, "degrees"); !status.ok()) return status;
  if (absl::Status status = within("longitude", longitude, -360, 360, "degrees"); !status.ok()) return status;
  if (absl::Status status = within("height", height, -1e6, 1e8, "m"); !status.ok()) return status;

  const portable::SinCos phi = portable::sincos_degrees(latitude);
  const portable::SinCos lambda = portable::sincos_degrees(longitude);
  // From east, north, up to the Earth's axes.
  Eigen::Matrix3d axes;
  axes.col(0) << -lambda.sin, lambda.cos, 0;
  axes.col(1) << -phi.sin * lambda.cos, -phi.sin * lambda.sin, phi.cos;
  axes.col(2) << phi.cos * lambda.cos, phi.cos * lambda.sin, phi.sin;
  // The radius of curvature in the prime vertical; the polar part of the normal is shorter by 1 - e^2.
  const double normal = kEquatorialRadius / std::sqrt(1 - kEccentricitySquared * phi.sin * phi.sin);
  const Eigen::Vector3d position((normal + height) * axes(0, 2), (normal + height) * axes(1, 2),
                                 ((1 - kEccentricitySquared) * normal + height) * phi.sin);
  if (up == SiteUp::kGeocentric) {
    axes.col(2) = position.normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0)).normalized();
  }
  const absl::StatusOr<WorldPosition> place = canonical(SectorIndex{}, position, sector_size);
  if (!place.ok()) return place.status();
  return WorldPose{*place, Eigen::Quaterniond(axes).normalized()};
}

}  // namespace tessera
