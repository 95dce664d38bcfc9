#include "experiments/programs/people.h"

#include <absl/strings/str_cat.h>

#include <cmath>

namespace tessera {
namespace {

constexpr double kCrowdSectorSize = 32;  // m

}  // namespace

WorldBuilder plane(Precision precision) {
  WorldSettings settings;
  settings.precision = precision;
  settings.sector_size = kCrowdSectorSize;
  settings.gravity = UniformGravity{{0, 0, -9.81}};
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  return builder;
}

Eigen::Vector3d place_in_square(int n, int count, double apart, double height) {
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  const int column = n % side - side / 2;
  const int row = n / side - side / 2;
  return {apart * column + 0.1, apart * row + 0.2, height};
}

WorldDescription people_on_plane(Precision precision, const ProgramNumbers& inputs) {
  WorldBuilder builder = plane(precision);
  for (int n = 0; n < kPeople; ++n)
    add_character(builder, absl::StrCat("walker", n), place_in_square(n, kPeople, 4, kExampleStanding),
                  inputs);
  return builder.world();
}

WorldDescription wanderers_on_plane(Precision precision) {
  WorldDescription world = people_on_plane(precision, {});
  for (BodyDescription& body : world.bodies) {
    if (!body.programs.empty()) body.programs.push_back(example_program("wander", {{"pause", 0}}));
  }
  return world;
}

}  // namespace tessera
