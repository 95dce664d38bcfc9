// How programs that measure are placed in their bodies, by the parameters that they were found with.
#pragma once

#include <absl/strings/string_view.h>

#include <optional>

#include "lpss/base/pose.h"
#include "lpss/programs/ray_fan.h"
#include "tessera/batch.h"

namespace tessera::live {

// A parameter by its name; 0 where the program has none of that name.
double parameter_of(const FoundProgram& program, absl::string_view name);

// The pose of a sensor in its body: x is where it looks, z upwards. Nothing for one that measures in the
// frame of its body.
std::optional<Pose> mounting_of(const FoundProgram& program);

// Whether it measures as a camera does: a `ranger` whose rays go through a plane.
bool is_camera(const FoundProgram& program);

// Of a `ranger`.
RayFan fan_of(const FoundProgram& program);

}  // namespace tessera::live
