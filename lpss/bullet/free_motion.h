// The pose of a body after a time at its velocities.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace tessera::bullet {

// The same bits as in Bullet, if the body turns by no more than pi/4. Bullet turns no body by more than that;
// here it turns at its full spin.
btTransform after(const btRigidBody& body, btScalar time);

}  // namespace tessera::bullet
