// Satellite: latitude, longitude and height, as a receiver of satellite navigation shows them.
//
// The world is a plane that touches the ellipsoid of WGS 84 at a place (National Imagery and
// Mapping Agency, TR8350.2, 2000). Positions go through coordinates from the centre of the earth, and back by
// Bowring's formula (The accuracy of geodetic latitude and height equations, Survey Review 28, 1985), which
// is exact to far less than a millimetre at all heights that one flies at.
#include <array>
#include <cmath>
#include <numbers>

#include "lpss/base/portable_math.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace satellite {
namespace {

constexpr double kEquator = 6378137;                         // m, the radius at the equator
constexpr double kFlattening = 1 / 298.257223563;            // of the ellipsoid
constexpr double kPole = kEquator * (1 - kFlattening);       // m, the radius at a pole
constexpr double kSquare = kFlattening * (2 - kFlattening);  // of the first eccentricity
constexpr double kDegree = std::numbers::pi / 180;

enum class Parameter {
  kLatitude,
  kLongitude,
  kHeight,
  kHeading,
  kNoise,
  kHeightNoise,
  kVelocityNoise,
  kFrom,
  kErrors = 10,
  kHeightErrors = 15,
  kVelocityErrors = 20,
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"latitude", "deg", 0, -90, 90, "Of where the body started, or of another place; above 0 in the north,"},
    {"longitude", "deg", 0, -180, 180, "likewise; above 0 in the east,"},
    {"height", "m", 0, -1e4, 1e6, "and its height above the ellipsoid."},
    {"heading", "deg", 0, -360, 360, "Of the world's x axis: 0 is east, 90 north."},
    {"noise", "m", 0, 0, 1e4, "The standard deviation to the east and to the north, each, in a tick."},
    {"height_noise", "m", 0, 0, 1e4, "And of the height."},
    {"velocity_noise", "m/s", 0, 0, 1e3, "And of each velocity."},
    {"from_x", "m", 0, -1e7, 1e7,
     "Where the body started, from the place with that latitude, longitude and height: along the world's x "
     "axis,"},
    {"from_y", "m", 0, -1e7, 1e7, "its y axis,"},
    {"from_z", "m", 0, -1e7, 1e7, "and its z axis. There the world touches the earth."},
    {"offset", "m", 0, -1e4, 1e4, "The mean error to the east and to the north, each."},
    {"bias", "m", 0, 0, 1e4, "The standard deviation of an error that stays as it is from the start on,"},
    {"drift", "m", 0, 0, 1e4, "and of one that wanders,"},
    {"drift_time", "s", 100, 0, 1e6, "and after this time has e^-1 of its correlation."},
    {"precision", "m", 0, 0, 1e4, "Ways to the east and to the north are multiples of this; 0: as they are."},
    {"height_offset", "m", 0, -1e4, 1e4, "Likewise of the height,"},
    {"height_bias", "m", 0, 0, 1e4, "likewise,"},
    {"height_drift", "m", 0, 0, 1e4, "likewise,"},
    {"height_drift_time", "s", 100, 0, 1e6, "likewise,"},
    {"height_precision", "m", 0, 0, 1e4, "likewise."},
    {"velocity_offset", "m/s", 0, -1e3, 1e3, "Likewise of each velocity,"},
    {"velocity_bias", "m/s", 0, 0, 1e3, "likewise,"},
    {"velocity_drift", "m/s", 0, 0, 1e3, "likewise,"},
    {"velocity_drift_time", "s", 100, 0, 1e6, "likewise,"},
    {"velocity_precision", "m/s", 0, 0, 1e3, "likewise."},
});

enum class Value { kLatitude, kLongitude, kHeight, kEast, kNorth, kUp, kDrift, kVelocityDrift = 9 };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"latitude", "deg", 0, 0, 0, "Of the centre of mass."},
    {"longitude", "deg", 0, 0, 0, "Likewise, within 180 degrees."},
    {"height", "m", 0, 0, 0, "Above the ellipsoid."},
    {"east", "m/s", 0, 0, 0, "The velocity along the plane that touches the earth, to the east,"},
    {"north", "m/s", 0, 0, 0, "to the north,"},
    {"up", "m/s", 0, 0, 0, "and upwards."},
    {"drift_east", "m", 0, 0, 0, "The error of the place that wanders, to the east,"},
    {"drift_north", "m", 0, 0, 0, "to the north,"},
    {"drift_up", "m", 0, 0, 0, "and upwards."},
    {"velocity_drift_east", "m/s", 0, 0, 0, "That of the velocity, to the east,"},
    {"velocity_drift_north", "m/s", 0, 0, 0, "to the north,"},
    {"velocity_drift_up", "m/s", 0, 0, 0, "and upwards."},
});

struct Place {
  double latitude = 0;   // rad
  double longitude = 0;  // rad
  double height = 0;     // m
};

// East, north and up at a place, as columns, from the axes of the earth.
Eigen::Matrix3d axes_at(const Place& place) {
  const auto [sin, cos] = portable::sincos(place.latitude);
  const auto [sin_of_longitude, cos_of_longitude] = portable::sincos(place.longitude);
  Eigen::Matrix3d axes;
  axes.col(0) << -sin_of_longitude, cos_of_longitude, 0;
  axes.col(1) << -sin * cos_of_longitude, -sin * sin_of_longitude, cos;
  axes.col(2) << cos * cos_of_longitude, cos * sin_of_longitude, sin;
  return axes;
}

// m, from the centre of the earth.
Eigen::Vector3d point_at(const Place& place) {
  const double sin = portable::sincos(place.latitude).sin;
  const double radius = kEquator / std::sqrt(1 - kSquare * sin * sin);  // of the curve to the east
  const Eigen::Vector3d up = axes_at(place).col(2);
  return {(radius + place.height) * up.x(), (radius + place.height) * up.y(),
          (radius * (1 - kSquare) + place.height) * up.z()};
}

Place place_of(const Eigen::Vector3d& point) {
  const double from_axis = std::sqrt(point.x() * point.x() + point.y() * point.y());
  const double from_centre = std::sqrt(from_axis * from_axis + point.z() * point.z());
  // The angle of the point below it, were the ellipsoid a sphere.
  const double reduced = portable::atan2(
      kPole * point.z() * (1 + (kSquare / (1 - kSquare)) * kPole / from_centre), kEquator * from_axis);
  const auto [sin, cos] = portable::sincos(reduced);
  Place place;
  place.latitude = portable::atan2(point.z() + kSquare / (1 - kSquare) * kPole * sin * sin * sin,
                                   from_axis - kSquare * kEquator * cos * cos * cos);
  place.longitude = portable::atan2(point.y(), point.x());
  const auto [rise, flat] = portable::sincos(place.latitude);
  place.height = from_axis * flat + point.z() * rise - kEquator * std::sqrt(1 - kSquare * rise * rise);
  return place;
}

class Satellite final : public Program {
 public:
  absl::string_view kind() const override { return "satellite"; }
  absl::string_view summary() const override {
    return "Measures latitude, longitude and height on the earth, from those of where its body started.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void run(const Senses& senses, std::span<double> values, Actor&) const override {
    const auto of = [&](Parameter place) { return at(senses.parameters, place); };
    const Place start{of(Parameter::kLatitude) * kDegree, of(Parameter::kLongitude) * kDegree,
                      of(Parameter::kHeight)};
    const Eigen::Vector3d from(&at(senses.parameters, Parameter::kFrom));
    const Eigen::Vector3d way = eastwards(senses, from + (senses.position() - senses.start));
    Eigen::Vector3d noise = noise_vector(senses, of(Parameter::kNoise), 0);
    const double height_noise = of(Parameter::kHeightNoise);
    noise.z() = height_noise > 0 ? height_noise * normal(senses, 2) : 0;
    const Place now = place_of(point_at(start) + axes_at(start) * shown_way(senses, way + noise, values));
    at(values, Value::kLatitude) = now.latitude / kDegree;
    at(values, Value::kLongitude) = now.longitude / kDegree;
    at(values, Value::kHeight) = now.height;
    const Eigen::Vector3d velocity = with_lasting_errors(
        senses, lasting_errors(senses, Parameter::kVelocityErrors),
        eastwards(senses, senses.velocity()) + noise_vector(senses, of(Parameter::kVelocityNoise), 3), 12,
        Eigen::Map<Eigen::Vector3d>(&at(values, Value::kVelocityDrift)));
    at(values, Value::kEast) = velocity.x();
    at(values, Value::kNorth) = velocity.y();
    at(values, Value::kUp) = velocity.z();
  }

 private:
  // A way to the east, to the north and upwards, with its lasting errors.
  static Eigen::Vector3d shown_way(const Senses& senses, const Eigen::Vector3d& way,
                                   std::span<double> values) {
    const LastingErrors errors = lasting_errors(senses, Parameter::kErrors);
    const LastingErrors height_errors = lasting_errors(senses, Parameter::kHeightErrors);
    double* const drift = &at(values, Value::kDrift);
    return {with_lasting_errors(senses, errors, way.x(), 6, 9, drift[0]),
            with_lasting_errors(senses, errors, way.y(), 7, 10, drift[1]),
            with_lasting_errors(senses, height_errors, way.z(), 8, 11, drift[2])};
  }
  // A vector of the world along east, north and up.
  static Eigen::Vector3d eastwards(const Senses& senses, const Eigen::Vector3d& vector) {
    const auto [sin, cos] = portable::sincos_degrees(at(senses.parameters, Parameter::kHeading));
    return {cos * vector.x() - sin * vector.y(), sin * vector.x() + cos * vector.y(), vector.z()};
  }
};

}  // namespace
}  // namespace satellite

const Program& satellite_program() {
  static const satellite::Satellite kSatellite;
  return kSatellite;
}

}  // namespace tessera
