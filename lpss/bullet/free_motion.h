// Where a body is after a time at its velocities.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace tessera::bullet {

// To the last bit where Bullet moves it, if it turns by no more than a quarter of half a turn. Bullet turns
// no body by more than that; here it turns as far as its spin takes it.
btTransform after(const btRigidBody& body, btScalar time);

}  // namespace tessera::bullet
