// Contacts on the inner edges of a terrain: uncorrected, a ball that rolls over an edge between two coplanar
// triangles hits it like a step.
#pragma once

#include "lpss/bullet/triangle_edges.h"

class btConcaveShape;
class btRigidBody;

namespace tessera::bullet {

// Stores for each triangle of a mesh or height field how it meets its neighbours; `edges` is empty, and must
// live as long as the shape.
void find_edges(btConcaveShape& shape, TriangleEdges& edges);

// Makes the contacts of a body with a triangle shape be corrected by its edges.
void smooth_contacts(btRigidBody& body);

}  // namespace tessera::bullet
