#include "lpss/native/broad_phase.h"

#include <algorithm>

namespace tessera::native {
namespace {

constexpr Scalar kEnlargedBy = Scalar(0.1);  // m
constexpr Scalar kTicksAhead = 4;            // that a body may go on before it leaves its enlarged box
constexpr Scalar kAheadMax = Scalar(2);      // m

}  // namespace

void BroadPhase::add(Body& body, BodySlot slot) {
  body.enlarged = body.bounds;
  body.left = Bounds::nothing();  // no other has ever overlapped it
  body.leaf = tree_.insert(volume(body.enlarged), nullptr);
  body.leaf->dataAsInt = slot;
  body.has_left = true;
  left_.push_back(slot);
}

void BroadPhase::remove(Body& body) {
  const BodySlot slot = body.leaf->dataAsInt;
  if (body.has_left) std::erase(left_, slot);
  tree_.remove(body.leaf);
  body.leaf = nullptr;
}

void BroadPhase::update(Body& body, BodySlot slot, Scalar dt) {
  if (body.enlarged.contains(body.bounds)) return;
  if (!body.has_left) {
    body.has_left = true;
    body.left = body.enlarged;
    left_.push_back(slot);
  }
  const Vector ahead = (body.linear * (dt * kTicksAhead))
                           .cwiseMax(Vector::Constant(-kAheadMax))
                           .cwiseMin(Vector::Constant(kAheadMax));
  body.enlarged = body.bounds.grown(kEnlargedBy);
  body.enlarged.low += ahead.cwiseMin(Vector::Zero());
  body.enlarged.high += ahead.cwiseMax(Vector::Zero());
  btDbvtVolume changed = volume(body.enlarged);
  tree_.update(body.leaf, changed);
}

void BroadPhase::rest() {
  left_.shrink_to_fit();
  found_by_piece_ = {};
  found_ = {};
  merged_ = {};
}

}  // namespace tessera::native
