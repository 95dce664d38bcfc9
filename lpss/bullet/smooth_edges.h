// Contacts on the inner edges of a terrain: without care, a ball that rolls over an edge between two
// triangles in one plane meets it as if it were a step.
#pragma once

class btBvhTriangleMeshShape;
class btHeightfieldTerrainShape;
class btRigidBody;
struct btTriangleInfoMap;

namespace tessera::bullet {

// Notes for each triangle how it meets its neighbours; `map` must live as long as the shape.
void find_edges(btBvhTriangleMeshShape& shape, btTriangleInfoMap& map);
void find_edges(btHeightfieldTerrainShape& shape, btTriangleInfoMap& map);

// Lets the contacts of a body with a shape of triangles be corrected by what was found of its edges.
void smooth_contacts(btRigidBody& body);

}  // namespace tessera::bullet
