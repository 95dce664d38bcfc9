// The pose of a body after a time at its velocities.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace tessera::bullet {

// As btTransformUtil::integrateTransform(), but with the same bits on every processor, and without its limit:
// Bullet turns no body by more than pi/4 in one step; here a body turns at its full spin. A spin that is not
// finite turns nothing.
btTransform after(const btTransform& start, const btVector3& velocity, const btVector3& spin, btScalar time);
btTransform after(const btRigidBody& body, btScalar time);

}  // namespace tessera::bullet
