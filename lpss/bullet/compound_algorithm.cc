#include "lpss/bullet/compound_algorithm.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>

#include <algorithm>
#include <new>

namespace tessera::bullet {
namespace {

const btCompoundShape* compound_of(const btCollisionObjectWrapper& body) {
  const btCollisionShape* shape = body.getCollisionShape();
  return shape->isCompound() ? static_cast<const btCompoundShape*>(shape) : nullptr;
}

// One child of a body, or the body itself if its shape is not a compound.
class ChildWrapper {
 public:
  ChildWrapper(const btCollisionObjectWrapper& body, int child)
      : pose_(compound_of(body) ? body.getWorldTransform() * compound_of(body)->getChildTransform(child)
                                : body.getWorldTransform()),
        wrapper_(&body,
                 compound_of(body) ? compound_of(body)->getChildShape(child) : body.getCollisionShape(),
                 body.getCollisionObject(), pose_, -1, compound_of(body) ? child : -1) {}

  const btCollisionObjectWrapper* get() const { return &wrapper_; }

 private:
  btTransform pose_;
  btCollisionObjectWrapper wrapper_;
};

int child_count(const btCollisionObjectWrapper& body) {
  const btCompoundShape* compound = compound_of(body);
  return compound ? compound->getNumChildShapes() : 1;
}

// The children of `body`, a compound, whose boxes come near the box of `shape` posed in the compound's frame.
template <typename Found>
void children_near(const btCompoundShape& compound, const btCollisionShape& shape, const btTransform& pose,
                   const Found& found) {
  struct Collector final : btDbvt::ICollide {
    explicit Collector(const Found& f) : found(f) {}
    void Process(const btDbvtNode* leaf) override { found(leaf->dataAsInt); }
    const Found& found;
  };
  btVector3 low;
  btVector3 high;
  shape.getAabb(pose, low, high);
  // Points further apart than this are never contacts, whatever the shapes.
  const btVector3 reach(gContactBreakingThreshold, gContactBreakingThreshold, gContactBreakingThreshold);
  Collector collector(found);
  const btDbvt& tree = *compound.getDynamicAabbTree();
  tree.collideTV(tree.m_root, btDbvtVolume::FromMM(low - reach, high + reach), collector);
}

std::vector<ChildPair> near_children(const btCollisionObjectWrapper& first,
                                     const btCollisionObjectWrapper& second) {
  std::vector<ChildPair> near;
  const btCompoundShape* a = compound_of(first);
  const btCompoundShape* b = compound_of(second);
  if (a) {
    const btTransform second_in_first = first.getWorldTransform().inverse() * second.getWorldTransform();
    for (int j = 0; j < child_count(second); ++j) {
      const btCollisionShape& shape = b ? *b->getChildShape(j) : *second.getCollisionShape();
      const btTransform pose = b ? second_in_first * b->getChildTransform(j) : second_in_first;
      children_near(*a, shape, pose, [&](int i) { near.push_back({i, j}); });
    }
  } else {
    const btTransform first_in_second = second.getWorldTransform().inverse() * first.getWorldTransform();
    children_near(*b, *first.getCollisionShape(), first_in_second, [&](int j) { near.push_back({0, j}); });
  }
  std::sort(near.begin(), near.end());
  return near;
}

}  // namespace

CompoundAlgorithm::~CompoundAlgorithm() {
  for (Part& part : parts_) release(part);
}

btCollisionAlgorithm* CompoundAlgorithm::CreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper*,
    const btCollisionObjectWrapper*) {
  void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(CompoundAlgorithm));
  return new (memory) CompoundAlgorithm(info);
}

void CompoundAlgorithm::processCollision(const btCollisionObjectWrapper* first,
                                         const btCollisionObjectWrapper* second, const btDispatcherInfo& info,
                                         btManifoldResult*) {
  std::vector<Part> parts;
  auto old = parts_.begin();
  for (const ChildPair& children : near_children(*first, *second)) {
    while (old != parts_.end() && old->children < children) release(*old++);
    if (old != parts_.end() && old->children == children) {
      parts.push_back(*old++);
    } else {
      parts.push_back({children, nullptr, nullptr});
    }
  }
  while (old != parts_.end()) release(*old++);
  parts_ = std::move(parts);
  for (Part& part : parts_) process(part, *first, *second, info);
}

void CompoundAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (const Part& part : parts_) {
    if (part.manifold) manifolds.push_back(part.manifold);
  }
}

btPersistentManifold* CompoundAlgorithm::manifold_of(ChildPair children,
                                                     const btCollisionObjectWrapper* first,
                                                     const btCollisionObjectWrapper* second,
                                                     const btDispatcherInfo& info) {
  if (children.first < 0 || children.first >= child_count(*first)) return nullptr;
  if (children.second < 0 || children.second >= child_count(*second)) return nullptr;
  auto place = std::lower_bound(parts_.begin(), parts_.end(), children,
                                [](const Part& part, const ChildPair& key) { return part.children < key; });
  if (place == parts_.end() || place->children != children) {
    place = parts_.insert(place, {children, nullptr, nullptr});
    process(*place, *first, *second, info);
  }
  return place->manifold;
}

void CompoundAlgorithm::process(Part& part, const btCollisionObjectWrapper& first,
                                const btCollisionObjectWrapper& second, const btDispatcherInfo& info) {
  const ChildWrapper a(first, part.children.first);
  const ChildWrapper b(second, part.children.second);
  if (!part.algorithm)
    part.algorithm = m_dispatcher->findAlgorithm(a.get(), b.get(), nullptr, BT_CONTACT_POINT_ALGORITHMS);
  btManifoldResult result(a.get(), b.get());
  result.setShapeIdentifiersA(-1, part.children.first);
  result.setShapeIdentifiersB(-1, part.children.second);
  part.algorithm->processCollision(a.get(), b.get(), info, &result);
  if (!part.manifold) {
    btManifoldArray manifolds;
    part.algorithm->getAllContactManifolds(manifolds);
    if (manifolds.size() > 0) {
      part.manifold = manifolds[0];
      set_child_pair(*part.manifold, part.children);
    }
  }
}

void CompoundAlgorithm::release(Part& part) {
  if (!part.algorithm) return;
  part.algorithm->~btCollisionAlgorithm();
  m_dispatcher->freeCollisionAlgorithm(part.algorithm);
  part.algorithm = nullptr;
}

}  // namespace tessera::bullet
