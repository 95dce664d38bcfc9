// How far down a body reaches.
#pragma once

#include "lpss/base/pose.h"
#include "lpss/model/shape.h"

namespace tessera {

// m along z, of the lowest point of a shape whose body frame is at `body`; infinite for what only static
// bodies have: planes, meshes, height fields.
double lowest_point(const Shape& shape, const Pose& body);

}  // namespace tessera
