#include "lpss/simulation/example_programs.h"

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>

#include "lpss/base/invariant.h"
#include "lpss/base/portable_math.h"

namespace tessera {

ProgramRecord example_program(absl::string_view kind, const ProgramNumbers& numbers) {
  absl::StatusOr<ProgramRecord> record = new_program(kind);
  invariant(record.ok(), "an example has programs that there are");
  for (const auto& [name, value] : numbers)
    invariant(set_number(*record, name, value).ok(), "an example has numbers that its program has");
  return *std::move(record);
}

BodyDescription& add_character(WorldBuilder& builder, const std::string& name,
                               const Eigen::Vector3d& position, const ProgramNumbers& numbers) {
  BodyDescription& body = builder.add(name, builder.shape(Capsule{0.3, 0.6}), 80, position);
  body.properties.friction = 0;
  body.programs.push_back(example_program("character", numbers));
  return body;
}

BodyDescription& add_car(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& position,
                         const ProgramNumbers& numbers) {
  BodyDescription& body = builder.add(name, builder.shape(Box{{4, 1.7, 0.5}}), 1200, position);
  body.properties.inertia = {500, 1700, 1900};
  body.programs.push_back(example_program("vehicle", numbers));
  return body;
}

WorldDescription crowd_world(const WorldSettings& settings) {
  constexpr int kWalkers = 24;
  WorldBuilder builder(settings);
  builder.add_floor(60, 0);
  builder.add("lift", builder.shape(Box{{3, 3, 0.2}}), 1, {0, 4, 0.1}, Motion::kKinematic)
      .programs.push_back(example_program("mover", {{"x", 5}, {"z", 3}, {"repeat", 1}, {"wait", 0.5}}));
  for (int n = 0; n < kWalkers; ++n) {
    const double angle = 360.0 * n / kWalkers;
    const auto [sin, cos] = portable::sincos_degrees(angle);
    add_character(builder, absl::StrCat("walker", n), {12 * cos + 0.07 * n, 12 * sin, kExampleStanding},
                  {{"x", -1.5 * cos}, {"y", -1.5 * sin}, {"heading", angle / 60}});
  }
  const ShapeId crate = builder.shape(Box{{0.8, 0.8, 0.8}});
  for (int n = 0; n < 12; ++n)
    builder.add(absl::StrCat("crate", n), crate, 20, {0.9 * (n % 4) - 2.0, 0.9 * (n % 3) - 1.5, 0.45});
  return builder.world();
}

}  // namespace tessera
