// Contacts of compound shapes, independent of history.
//
// Bullet's own algorithms for compounds keep their children's contact manifolds in an order that depends on
// which of them touched first, and do not tell which manifold belongs to which children. Both would
// break the guarantee that a world can be taken apart and rebuilt without changing a bit.
#pragma once

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <compare>
#include <vector>

namespace tessera::bullet {

// Which children of a pair's two shapes a manifold belongs to; 0 for a shape that is not a compound.
struct ChildPair {
  int first = 0;  // of the body with the lower id
  int second = 0;

  friend auto operator<=>(const ChildPair&, const ChildPair&) = default;
};

// A manifold carries its child pair in two numbers that Bullet reserves for the user.
inline ChildPair child_pair(const btPersistentManifold& manifold) {
  return {manifold.m_companionIdA, manifold.m_companionIdB};
}
inline void set_child_pair(btPersistentManifold& manifold, ChildPair children) {
  manifold.m_companionIdA = children.first;
  manifold.m_companionIdB = children.second;
}

// The manifold of a sweep belongs to no children, but to the one body of its pair that was swept; both may
// be.
inline void mark_predictive(btPersistentManifold& manifold, bool is_first_swept) {
  set_child_pair(manifold, {is_first_swept ? -2 : -1, 0});
}
inline bool is_predictive(const btPersistentManifold& manifold) { return manifold.m_companionIdA < 0; }

// A pair in which at least one shape is a (flat) compound. Which children are tested is a function of the
// current poses alone; they are tested in ascending order.
class CompoundAlgorithm final : public btCollisionAlgorithm {
 public:
  explicit CompoundAlgorithm(const btCollisionAlgorithmConstructionInfo& info) : btCollisionAlgorithm(info) {}
  ~CompoundAlgorithm() override;

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override;

  // The manifold of two children, created if missing; null if the shapes have no such children.
  btPersistentManifold* manifold_of(ChildPair children, const btCollisionObjectWrapper* first,
                                    const btCollisionObjectWrapper* second, const btDispatcherInfo& info);

  struct CreateFunc final : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper* first,
                                                   const btCollisionObjectWrapper* second) override;
  };

 private:
  struct Part {
    ChildPair children;
    btCollisionAlgorithm* algorithm = nullptr;
    btPersistentManifold* manifold = nullptr;
  };

  void process(Part& part, const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second,
               const btDispatcherInfo& info);
  void release(Part& part);

  std::vector<Part> parts_;  // in ascending order of children
};

}  // namespace tessera::bullet
