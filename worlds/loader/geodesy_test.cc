#include "worlds/loader/geodesy.h"

#include <gmock/gmock.h>

#include <GeographicLib/Geocentric.hpp>
#include <vector>

namespace tessera {
namespace {

constexpr double kSectorSize = 128;

WorldPose site(double latitude, double longitude, double height, SiteUp up = SiteUp::kGeodetic) {
  const absl::StatusOr<WorldPose> frame = site_frame(latitude, longitude, height, up, kSectorSize);
  EXPECT_TRUE(frame.ok()) << frame.status();
  return frame.ok() ? *frame : WorldPose{};
}

Eigen::Vector3d place(const WorldPose& frame) {
  return relative_to(frame.position, SectorIndex{}, kSectorSize);
}

TEST(SiteFrame, AgreesWithGeographicLib) {
  for (const double height : {-1e4, 0.0, 123.456, 4e5, 9e7}) {
    for (double latitude = -90; latitude <= 90; latitude += 7.5) {
      for (double longitude = -360; longitude <= 360; longitude += 11.25) {
        Eigen::Vector3d expected;
        std::vector<double> rotation(9);
        GeographicLib::Geocentric::WGS84().Forward(latitude, longitude, height, expected.x(), expected.y(),
                                                   expected.z(), rotation);
        const WorldPose frame = site(latitude, longitude, height);
        EXPECT_LT((place(frame) - expected).norm(), 4e-16 * (6.4e6 + std::abs(height)))
            << latitude << " " << longitude << " " << height;
        const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> axes(rotation.data());
        EXPECT_LT((frame.orientation.toRotationMatrix() - axes).norm(), 2e-15)
            << latitude << " " << longitude;
      }
    }
  }
}

TEST(SiteFrame, IsExactAtPolesAndQuarters) {
  EXPECT_EQ(place(site(0, 0, 0)), Eigen::Vector3d(6378137, 0, 0));
  EXPECT_EQ(place(site(0, 90, 0)), Eigen::Vector3d(0, 6378137, 0));
  EXPECT_EQ(place(site(0, -180, 0)), Eigen::Vector3d(-6378137, 0, 0));
  const Eigen::Vector3d pole = place(site(90, 45, 0));
  EXPECT_EQ(pole.head<2>(), Eigen::Vector2d::Zero());
  EXPECT_NEAR(pole.z(), 6356752.314245179, 1e-9);
}

TEST(SiteFrame, GeocentricUpIsAwayFromTheCentre) {
  const WorldPose frame = site(52, 4, 10, SiteUp::kGeocentric);
  EXPECT_LT((frame.orientation * Eigen::Vector3d::UnitZ() - place(frame).normalized()).norm(), 1e-15);
}

}  // namespace
}  // namespace tessera
