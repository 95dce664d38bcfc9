#include "lpss/bullet/flat_faces.h"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include <algorithm>
#include <new>

#include "lpss/base/rotation.h"
#include "lpss/bullet/conversions.h"

namespace tessera::bullet {
namespace {

constexpr int kTilts = 3;  // a third of a turn apart; as many points are enough to go without

constexpr btScalar kTiltMax = btScalar(0.125) * SIMD_PI;  // rad

// By which a shape is tilted, rad: its surface moves by no more than contacts may be apart.
btScalar tilt_of(btScalar radius) { return std::min(gContactBreakingThreshold / radius, kTiltMax); }

// A unit vector at a right angle to the unit vector `normal`, one for each tilt.
btVector3 across(const btVector3& normal, int tilt) {
  constexpr btScalar kCosines[kTilts] = {1, btScalar(-0.5), btScalar(-0.5)};
  constexpr btScalar kSines[kTilts] = {0, btScalar(0.86602540378443865), btScalar(-0.86602540378443865)};
  btVector3 p;
  btVector3 q;
  btPlaneSpace1(normal, p, q);
  return p * kCosines[tilt] - q * kSines[tilt];
}

// Has a manifold: that of a concave shape's algorithm, or from its first use one of its own.
class ManifoldAlgorithm : public btCollisionAlgorithm {
 public:
  explicit ManifoldAlgorithm(const btCollisionAlgorithmConstructionInfo& info)
      : btCollisionAlgorithm(info), manifold_(info.m_manifold) {}
  ~ManifoldAlgorithm() override {
    if (is_own_) m_dispatcher->releaseManifold(manifold_);
  }
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    if (is_own_) manifolds.push_back(manifold_);
  }

 protected:
  void begin(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b, btManifoldResult& result) {
    if (!manifold_) {
      manifold_ = m_dispatcher->getNewManifold(a.getCollisionObject(), b.getCollisionObject());
      is_own_ = true;
    }
    result.setPersistentManifold(manifold_);
  }
  btScalar reach(const btManifoldResult& result) const {
    return manifold_->getContactBreakingThreshold() + result.m_closestPointDistanceThreshold;
  }
  bool needs_points() const { return manifold_->getNumContacts() < kTilts; }
  void end(btManifoldResult& result) const {
    if (is_own_) result.refreshContactPoints();
  }

 private:
  btPersistentManifold* manifold_;
  bool is_own_ = false;
};

// Passes on the points of a tilted pair as they are on the upright one.
class UprightResult final : public btDiscreteCollisionDetectorInterface::Result {
 public:
  // `back` moves the tilted shape, the first or the second, upright.
  UprightResult(btManifoldResult& result, const btTransform& back, bool is_first_tilted)
      : result_(result), back_(back), is_first_tilted_(is_first_tilted) {}

  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normal, const btVector3& on_second, btScalar depth) override {
    const btVector3 on_first = on_second + normal * depth;
    const btVector3 first = is_first_tilted_ ? back_ * on_first : on_first;
    const btVector3 second = is_first_tilted_ ? on_second : back_ * on_second;
    const btScalar gap = (first - second).dot(normal);
    result_.addContactPoint(normal, is_first_tilted_ ? first - normal * gap : second, gap);
  }

 private:
  btManifoldResult& result_;
  const btTransform back_;
  const bool is_first_tilted_;
};

class FlatFaceAlgorithm final : public ManifoldAlgorithm {
 public:
  FlatFaceAlgorithm(const btCollisionAlgorithmConstructionInfo& info,
                    btConvexPenetrationDepthSolver* penetration)
      : ManifoldAlgorithm(info), penetration_(penetration) {}

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo&, btManifoldResult* result) override {
    begin(*first, *second, *result);
    const auto& a = static_cast<const btConvexShape&>(*first->getCollisionShape());
    const auto& b = static_cast<const btConvexShape&>(*second->getCollisionShape());
    btVoronoiSimplexSolver simplex;
    btGjkPairDetector detector(&a, &b, &simplex, penetration_);
    btGjkPairDetector::ClosestPointInput input;
    input.m_transformA = first->getWorldTransform();
    input.m_transformB = second->getWorldTransform();
    const btScalar distance = a.getMargin() + b.getMargin() + reach(*result);
    input.m_maximumDistanceSquared = distance * distance;
    detector.getClosestPoints(input, *result, nullptr);
    const btVector3 axis = detector.getCachedSeparatingAxis();
    if (needs_points() && axis.length2() > SIMD_EPSILON)
      tilt(a.getAngularMotionDisc(), b.getAngularMotionDisc(), axis.normalized(), detector, input, *result);
    end(*result);
  }

 private:
  // Tilts the smaller shape.
  static void tilt(btScalar radius_a, btScalar radius_b, const btVector3& axis, btGjkPairDetector& detector,
                   btGjkPairDetector::ClosestPointInput& input, btManifoldResult& result) {
    const bool is_first = radius_a < radius_b;
    const btScalar angle = tilt_of(std::min(radius_a, radius_b));
    btTransform& tilted = is_first ? input.m_transformA : input.m_transformB;
    const btTransform upright = tilted;
    for (int n = 0; n < kTilts; ++n) {
      const Eigen::Quaterniond turn = rotation_by(to_eigen(across(axis, n) * angle));
      tilted.setBasis(to_bullet(Pose{{0, 0, 0}, turn}).getBasis() * upright.getBasis());
      UprightResult points(result, upright * tilted.inverse(), is_first);
      detector.getClosestPoints(input, points, nullptr);
    }
  }

  btConvexPenetrationDepthSolver* const penetration_;
};

bool is_plane(const btCollisionObjectWrapper& body) {
  return body.getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
}

// The corners that are lowest with the plane tilted each way.
class FlatFaceOnPlaneAlgorithm final : public ManifoldAlgorithm {
 public:
  using ManifoldAlgorithm::ManifoldAlgorithm;

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo&, btManifoldResult* result) override {
    const btCollisionObjectWrapper& plane = is_plane(*first) ? *first : *second;
    const btCollisionObjectWrapper& body = is_plane(*first) ? *second : *first;
    begin(body, plane, *result);
    const auto& surface = static_cast<const btStaticPlaneShape&>(*plane.getCollisionShape());
    const auto& convex = static_cast<const btConvexShape&>(*body.getCollisionShape());
    const btVector3 normal = plane.getWorldTransform().getBasis() * surface.getPlaneNormal();
    const btVector3 origin =
        plane.getWorldTransform() * (surface.getPlaneNormal() * surface.getPlaneConstant());
    const auto add_lowest = [&](const btVector3& down) {
      const btVector3 corner = body.getWorldTransform() *
                               convex.localGetSupportingVertex(down * body.getWorldTransform().getBasis());
      const btScalar gap = (corner - origin).dot(normal);
      if (gap < reach(*result)) result->addContactPoint(normal, corner - normal * gap, gap);
    };
    add_lowest(-normal);
    if (needs_points()) {
      const btScalar slope = tilt_of(convex.getAngularMotionDisc());
      for (int n = 0; n < kTilts; ++n) add_lowest(-normal + across(normal, n) * slope);
    }
    end(*result);
  }
};

}  // namespace

btCollisionAlgorithm* FlatFaceAlgorithms::CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                                   const btCollisionObjectWrapper*,
                                                                   const btCollisionObjectWrapper*) {
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(FlatFaceAlgorithm));
  return new (memory) FlatFaceAlgorithm(info, penetration_);
}

btCollisionAlgorithm* FlatFaceOnPlaneAlgorithms::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper*,
    const btCollisionObjectWrapper*) {
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(FlatFaceOnPlaneAlgorithm));
  return new (memory) FlatFaceOnPlaneAlgorithm(info);
}

}  // namespace tessera::bullet
