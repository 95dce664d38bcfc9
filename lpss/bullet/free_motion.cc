#include "lpss/bullet/free_motion.h"

#include "lpss/base/rotation.h"
#include "lpss/bullet/conversions.h"

namespace tessera::bullet {

btTransform after(const btTransform& start, const btVector3& velocity, const btVector3& spin, btScalar time) {
  btTransform end(start.getBasis(), start.getOrigin() + velocity * time);
  const Eigen::Quaterniond turn = rotation_by(to_eigen(spin) * double(time));
  btQuaternion orientation =
      btQuaternion(btScalar(turn.x()), btScalar(turn.y()), btScalar(turn.z()), btScalar(turn.w())) *
      start.getRotation();
  if (orientation.length2() > SIMD_EPSILON) end.setRotation(orientation.normalize());
  return end;
}

btTransform after(const btRigidBody& body, btScalar time) {
  return after(body.getWorldTransform(), body.getLinearVelocity(), body.getAngularVelocity(), time);
}

}  // namespace tessera::bullet
