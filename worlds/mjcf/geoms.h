// Geoms of MuJoCo as shapes.
#pragma once

#include <vector>

#include "lpss/model/body.h"
#include "worlds/loader/look.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/shape_table.h"
#include "worlds/mjcf/contact_kinds.h"
#include "worlds/mjcf/model.h"

namespace tessera::mjcf {

struct PlacedGeom {
  int geom = 0;
  Pose pose;  // in the frame of the body of ours
};

// Gives a body the shape and the surface of these geoms, as far as they collide. Whether any does: if not,
// the body has a small shape that collides with nothing. A mesh is the convex hull of its points, as in
// MuJoCo.
bool set_shape(const Model& model, const std::vector<ContactBits>& bits, const std::vector<PlacedGeom>& geoms,
               ShapeTable& shapes, BodyProperties& properties, Notices& notices);

// What MuJoCo shows at first: geoms of the groups 0 to 2. Without parts if there is none.
Look look_of(const Model& model, const std::vector<PlacedGeom>& geoms);

}  // namespace tessera::mjcf
