// Which pairs of bodies may touch. Each body has an enlarged box in a tree, and only one that leaves it
// searches for partners again. The pairs that it gives depend on the tight boxes alone, and not on the past.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <absl/container/inlined_vector.h>

#include <cmath>
#include <vector>

#include "lpss/base/parallel.h"
#include "lpss/native/body.h"

namespace tessera::native {

// Two bodies whose enlarged boxes overlap; `a` has the lower id.
struct Candidate {
  BodyId a;
  BodyId b;
  BodySlot slot_a = 0;
  BodySlot slot_b = 0;
  std::int32_t contact = kNone;  // in the world's list

  static constexpr std::int32_t kNone = -1;

  auto key() const { return std::pair(a.value, b.value); }
};

// A box that goes along a line without turning; a ray, if it has no size. In double precision.
struct BoxOnWay {
  Eigen::Vector3d from;  // m, its middle
  Eigen::Vector3d to;
  Eigen::Vector3d half = Eigen::Vector3d::Zero();

  // Whether it meets another box (Ericson, Real-Time Collision Detection, 2005, section 5.3.3).
  bool meets(const Eigen::Vector3d& low, const Eigen::Vector3d& high) const {
    const Eigen::Vector3d way = (to - from) / 2;
    const Eigen::Vector3d reach = (high - low) / 2 + half;
    const Eigen::Vector3d away = (from + to) / 2 - (low + high) / 2;
    const Eigen::Vector3d length = way.cwiseAbs();
    if ((away.cwiseAbs().array() > (reach + length).array()).any()) return false;
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3;
      const int j = (k + 2) % 3;
      if (std::abs(way[i] * away[j] - way[j] * away[i]) > reach[i] * length[j] + reach[j] * length[i])
        return false;
    }
    return true;
  }
};

class BroadPhase {
 public:
  BroadPhase() = default;
  BroadPhase(const BroadPhase&) = delete;
  BroadPhase& operator=(const BroadPhase&) = delete;

  void add(Body& body, BodySlot slot);
  void remove(Body& body);

  // Puts an enlarged box around `body.bounds` if that has left the present one.
  void update(Body& body, BodySlot slot, Scalar dt);

  // Brings `candidates`, ascending by ids, up to date with all bodies that were updated since the last call.
  // `is_wanted(a, b)` as of the addition of the two.
  template <typename IsWanted>
  void find_pairs(std::vector<Body>& bodies, std::vector<Candidate>& candidates, const IsWanted& is_wanted,
                  const ParallelFor& parallel = {});

  // Gives back the memory of searches.
  void rest();

  // Calls `visit(slot)` for each body whose enlarged box overlaps. Safe on several threads at a time.
  template <typename Visit>
  void for_each_in(const Bounds& bounds, const Visit& visit) const {
    const btDbvtVolume wanted = volume(bounds);
    for_each_where([&](const btDbvtVolume& its) { return Intersect(its, wanted); }, visit);
  }

  // Likewise of those that a box meets on its way.
  template <typename Visit>
  void for_each_along(const BoxOnWay& way, const Visit& visit) const {
    for_each_where(
        [&](const btDbvtVolume& its) {
          return way.meets(vector(its.Mins()).cast<double>(), vector(its.Maxs()).cast<double>());
        },
        visit);
  }

 private:
  // The new pairs of the body in `slot`, which has left its enlarged box.
  template <typename IsWanted>
  void search(const std::vector<Body>& bodies, BodySlot slot, const IsWanted& is_wanted,
              std::vector<Candidate>& found) const;

  template <typename IsWanted, typename Visit>
  void for_each_where(const IsWanted& is_wanted, const Visit& visit) const;

  static btDbvtVolume volume(const Bounds& bounds) {
    return btDbvtVolume::FromMM(bt(bounds.low), bt(bounds.high));
  }

  btDbvt tree_;
  std::vector<BodySlot> left_;  // bodies that left their enlarged boxes since the last find_pairs()
  std::vector<std::vector<Candidate>> found_by_piece_;
  std::vector<Candidate> found_;
  std::vector<Candidate> merged_;
};

template <typename IsWanted>
void BroadPhase::search(const std::vector<Body>& bodies, BodySlot slot, const IsWanted& is_wanted,
                        std::vector<Candidate>& found) const {
  const Body& body = bodies[static_cast<std::size_t>(slot)];
  for_each_in(body.enlarged, [&](BodySlot other_slot) {
    if (other_slot == slot) return;
    const Body& other = bodies[static_cast<std::size_t>(other_slot)];
    if (other.has_left && other_slot < slot) return;  // it finds the pair
    // A pair whose enlarged boxes overlapped before is there already.
    if (body.left.overlaps(other.has_left ? other.left : other.enlarged)) return;
    if (!is_wanted(body, other)) return;
    if (body.id < other.id) {
      found.push_back({body.id, other.id, slot, other_slot, Candidate::kNone});
    } else {
      found.push_back({other.id, body.id, other_slot, slot, Candidate::kNone});
    }
  });
}

template <typename IsWanted>
void BroadPhase::find_pairs(std::vector<Body>& bodies, std::vector<Candidate>& candidates,
                            const IsWanted& is_wanted, const ParallelFor& parallel) {
  if (left_.empty()) return;
  constexpr std::size_t kLeftInPiece = 32;
  const Pieces pieces(left_.size(), kLeftInPiece);
  if (found_by_piece_.size() < pieces.count()) found_by_piece_.resize(pieces.count());
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    found_by_piece_[piece].clear();
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n)
      search(bodies, left_[n], is_wanted, found_by_piece_[piece]);
  });
  found_.clear();
  for (std::size_t piece = 0; piece < pieces.count(); ++piece)
    found_.insert(found_.end(), found_by_piece_[piece].begin(), found_by_piece_[piece].end());
  for (const BodySlot slot : left_) bodies[static_cast<std::size_t>(slot)].has_left = false;
  left_.clear();
  if (found_.empty()) return;
  const auto by_key = [](const Candidate& x, const Candidate& y) { return x.key() < y.key(); };
  std::sort(found_.begin(), found_.end(), by_key);
  merged_.clear();
  merged_.reserve(candidates.size() + found_.size());
  auto old = candidates.begin();
  for (const Candidate& candidate : found_) {
    while (old != candidates.end() && old->key() < candidate.key()) merged_.push_back(*old++);
    if (old != candidates.end() && old->key() == candidate.key()) continue;
    merged_.push_back(candidate);
  }
  merged_.insert(merged_.end(), old, candidates.end());
  candidates.swap(merged_);
}

template <typename IsWanted, typename Visit>
void BroadPhase::for_each_where(const IsWanted& is_wanted, const Visit& visit) const {
  if (!tree_.m_root) return;
  absl::InlinedVector<const btDbvtNode*, 64> stack = {tree_.m_root};
  while (!stack.empty()) {
    const btDbvtNode* node = stack.back();
    stack.pop_back();
    if (!is_wanted(node->volume)) continue;
    if (node->isleaf()) {
      visit(static_cast<BodySlot>(node->dataAsInt));
    } else {
      stack.push_back(node->childs[0]);
      stack.push_back(node->childs[1]);
    }
  }
}

}  // namespace tessera::native
