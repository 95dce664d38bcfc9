// Surfaces of bodies: bounds, with messages that name the field.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <span>
#include <string>

#include "lpss/model/validate.h"

namespace tessera {
namespace {

using testing::HasSubstr;

std::string verdict(const Surface& surface) {
  const Shape shape{{ShapePart{Box{}, Pose{}}}};
  BodyDescription body;
  body.name = "belt";
  body.properties.surface = surface;
  return std::string(validate(body, shape, WorldSettings{}).message());
}

TEST(ValidateSurface, WithinItsBounds) {
  EXPECT_EQ(verdict({}), "");
  EXPECT_EQ(verdict({{3, 0, 0}, 0.1, 0.5, 0.01, 0.02, {1, 0, 0}, {0, 1, 0}}), "");
}

TEST(ValidateSurface, BeyondThem) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(verdict({.direction = {0, kInfinite, 0}}),
              HasSubstr("friction direction y = inf must be finite"));
  EXPECT_THAT(verdict({.second_friction = -1}), HasSubstr("second friction = -1 must be at least 0"));
  EXPECT_THAT(verdict({.torsional_friction = kNan}), HasSubstr("torsional friction = nan must be finite"));
  EXPECT_THAT(verdict({.patch_radius = 1001}), HasSubstr("patch radius = 1001 m must be at most 1000 m"));
  EXPECT_THAT(verdict({.rolling_friction = -0.1}),
              HasSubstr("rolling friction = -0.1 m must be at least 0 m"));
  EXPECT_THAT(verdict({.velocity = {0, 1001, 0}}),
              HasSubstr("surface velocity = 1001 m/s must be at most 1000 m/s"));
  EXPECT_THAT(verdict({.running = {0, 0, -1001}}),
              HasSubstr("running surface = 1001 m/s must be at most 1000 m/s"));
}

std::string verdict_of_part(const PartMaterial& material) {
  Shape shape{{ShapePart{Box{}, Pose{}}}};
  shape.parts[0].material = material;
  return std::string(validate(shape, "shape").message());
}

TEST(ValidateSurface, OfParts) {
  EXPECT_EQ(verdict_of_part({}), "");
  EXPECT_EQ(verdict_of_part({0, 1, 0, 0, Surface{{3, 0, 0}, 0.1, 0.5, 0.01, 0.02}}), "");
  EXPECT_THAT(verdict_of_part({.friction = -1}),
              HasSubstr("shape: part 0: material: friction = -1 must be at least 0"));
  EXPECT_THAT(verdict_of_part({.restitution = 1.5}), HasSubstr("restitution = 1.5 must be at most 1"));
  EXPECT_THAT(verdict_of_part({.surface = {.patch_radius = 1001}}),
              HasSubstr("patch radius = 1001 m must be at most 1000 m"));
  EXPECT_THAT(verdict_of_part({.surface = {.velocity = {1, 0, 0}}}),
              HasSubstr("the surface of a part does not move by itself"));
}

}  // namespace
}  // namespace tessera
