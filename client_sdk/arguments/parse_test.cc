#include "client_sdk/arguments/parse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace tessera {
namespace {

using ::testing::HasSubstr;

TEST(ParseIntegerTest, ReadsDigitsAndPowersOfTwo) {
  EXPECT_EQ(parse_integer("0").value(), 0);
  EXPECT_EQ(parse_integer("-7").value(), -7);
  EXPECT_EQ(parse_integer("+0012").value(), 12);
  EXPECT_EQ(parse_integer("2^0").value(), 1);
  EXPECT_EQ(parse_integer("2^40").value(), std::int64_t{1} << 40);
  EXPECT_EQ(parse_integer("-2^62").value(), -(std::int64_t{1} << 62));
  EXPECT_EQ(parse_integer("-2^63").value(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(parse_integer("9223372036854775807").value(), std::numeric_limits<std::int64_t>::max());
}

TEST(ParseIntegerTest, RefusesWhatIsNoNumberOrTooLarge) {
  for (const char* text : {"", "-", "2^", "x", "1.5", "3^2", "--1", "2^-1", "0x10", "1e3"}) {
    EXPECT_EQ(parse_integer(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
  for (const char* text : {"2^63", "9223372036854775808", "-9223372036854775809", "2^64",
                           "2^999999999999999999999", "100000000000000000000000"}) {
    EXPECT_EQ(parse_integer(text).status().code(), absl::StatusCode::kOutOfRange) << text;
  }
}

TEST(ParseShiftTest, BoundsEachComponent) {
  EXPECT_EQ(parse_shift("2^62,-2^62,0").value(), (SectorOffset{kShiftMax, -kShiftMax, 0}));
  const absl::Status beyond = parse_shift("0,4611686018427387905,0").status();
  EXPECT_EQ(beyond.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(beyond.message()), HasSubstr("component J"));
  EXPECT_THAT(std::string(beyond.message()), HasSubstr("4611686018427387904"));
  EXPECT_FALSE(parse_shift("1,2").ok());
  EXPECT_FALSE(parse_shift("1,2,3,4").ok());
}

TEST(ParseVectorTest, WantsThreeFiniteNumbers) {
  EXPECT_EQ(parse_vector("1,-2.5,1e3").value(), Eigen::Vector3d(1, -2.5, 1000));
  for (const char* text : {"", "1,2", "1,2,3,4", "a,b,c", "1,2,nan", "inf,0,0"}) {
    EXPECT_FALSE(parse_vector(text).ok()) << text;
  }
}

TEST(ParseShapeTest, ReadsEachKind) {
  EXPECT_EQ(std::get<Box>(parse_shape("box:1,2,3")->parts[0].geometry).size, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(std::get<Sphere>(parse_shape("sphere:0.5")->parts[0].geometry).radius, 0.5);
  EXPECT_EQ(std::get<Capsule>(parse_shape("capsule:0.5,2")->parts[0].geometry).length, 2);
  EXPECT_EQ(std::get<Cylinder>(parse_shape("cylinder:0.5,2")->parts[0].geometry).radius, 0.5);
  EXPECT_EQ(std::get<Ellipsoid>(parse_shape("ellipsoid:1,2,3")->parts[0].geometry).radii.z(), 3);
  EXPECT_EQ(std::get<Plane>(parse_shape("plane:0,0,2")->parts[0].geometry).normal, Eigen::Vector3d::UnitZ());
  for (const char* text : {"", "box", "box:", "box:1", "sphere:1,2", "cone:1,1", "sphere:x"}) {
    EXPECT_FALSE(parse_shape(text).ok()) << text;
  }
}

}  // namespace
}  // namespace tessera
