// Contacts on the inner edges of a terrain: uncorrected, a ball that rolls over an edge between two coplanar
// triangles hits it like a step.
#pragma once

class btBvhTriangleMeshShape;
class btHeightfieldTerrainShape;
class btRigidBody;
struct btTriangleInfoMap;

namespace tessera::bullet {

// Stores for each triangle how it meets its neighbours; `map` must live as long as the shape.
void find_edges(btBvhTriangleMeshShape& shape, btTriangleInfoMap& map);
void find_edges(btHeightfieldTerrainShape& shape, btTriangleInfoMap& map);

// Makes the contacts of a body with a triangle shape be corrected by its edges.
void smooth_contacts(btRigidBody& body);

}  // namespace tessera::bullet
