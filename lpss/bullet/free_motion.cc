#include "lpss/bullet/free_motion.h"

#include <LinearMath/btTransformUtil.h>

namespace tessera::bullet {

btTransform after(const btRigidBody& body, btScalar time) {
  const btTransform& start = body.getWorldTransform();
  const btVector3& spin = body.getAngularVelocity();
  btTransform end;
  btTransformUtil::integrateTransform(start, body.getLinearVelocity(), spin, time, end);
  if (const btScalar turn = spin.length() * time; turn > ANGULAR_MOTION_THRESHOLD) {
    btQuaternion orientation = btQuaternion(spin, turn) * start.getRotation();
    end.setRotation(orientation.safeNormalize());
  }
  return end;
}

}  // namespace tessera::bullet
