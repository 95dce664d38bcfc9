// Balls, capsules and cylinders: what is within a radius of a line, and closed by round ends or flat caps.
// Where their sides or caps touch, the closest points are known in closed form.
#pragma once

#include <optional>

#include "lpss/collision/closest.h"

namespace tessera::collision {

enum class AxialCase { kUnknown, kApart, kFound };

// Looks at the cases that are simple: sides of two such shapes, and the caps of a cylinder below any shape.
// `found` is set if the answer is kFound; kApart: by more than `reach` (m). `before` as for closest().
template <typename Scalar>
AxialCase closest_axial(const Core<Scalar>& a, const Core<Scalar>& b, const Placement<Scalar>& placement,
                        std::type_identity_t<Scalar> reach, const Vector3<Scalar>& before,
                        Closest<Scalar>& found);

}  // namespace tessera::collision
