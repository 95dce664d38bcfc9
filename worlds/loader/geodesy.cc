#include "worlds/loader/geodesy.h"

#include <absl/strings/str_cat.h>

#include <GeographicLib/Geocentric.hpp>
#include <cmath>
#include <vector>

namespace tessera {
namespace {

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

  Eigen::Vector3d position;
  std::vector<double> rotation(9);  // rows: from east, north, up to the Earth's axes
  GeographicLib::Geocentric::WGS84().Forward(latitude, longitude, height, position.x(), position.y(),
                                             position.z(), rotation);
  Eigen::Matrix3d axes = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
  if (up == SiteUp::kGeocentric) {
    axes.col(2) = position.normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0)).normalized();
  }
  const absl::StatusOr<WorldPosition> place = canonical(SectorIndex{}, position, sector_size);
  if (!place.ok()) return place.status();
  return WorldPose{*place, Eigen::Quaterniond(axes).normalized()};
}

}  // namespace tessera
