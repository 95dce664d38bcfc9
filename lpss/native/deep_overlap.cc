#include "lpss/native/deep_overlap.h"

#include <absl/container/inlined_vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace tessera::native {
namespace {

// Of the thinnest of two parts: what is deeper may have come from the other side.
constexpr Scalar kDeepShare = Scalar(0.5);
// Cosines of normals: those of patches that press against each other, ...
constexpr Scalar kAgainst = Scalar(-0.5);
// ... and that of a patch beside others whose way is blocked by it.
constexpr Scalar kBlocks = Scalar(-0.2);
// Directions that are so much alike are one.
constexpr Scalar kSameDirection = Scalar(0.999);
// A direction must be shorter by this share than one before it.
constexpr Scalar kShorter = Scalar(1e-3);

Scalar depth_of(const ContactPatch& patch) {
  Scalar depth = 0;
  for (int n = 0; n < patch.count; ++n) depth = std::max(depth, -patch.point[n].gap);
  return depth;
}

// The box of a part, in world axes, relative to the centre of a.
struct PlacedBox {
  Matrix axes;
  Vector centre;
  Vector half;

  PlacedBox(const Body& body, const Part& part, const Vector& offset)
      : axes(body.pose.rotation * part.frame.rotation),
        centre(offset + body.pose.rotation * (part.frame * Vector((part.bounds.low + part.bounds.high) / 2))),
        half((part.bounds.high - part.bounds.low) / 2) {}
  Scalar reach(const Vector& direction) const {
    return half.dot(Vector(axes.transpose() * direction).cwiseAbs());
  }
};

using Overlap = std::pair<Scalar, Scalar>;

// While box a moves along a direction, from where to where it overlaps box b; empty if first > second. By the
// planes of their faces alone, which makes it no shorter than it is.
Overlap overlap_along(const PlacedBox& a, const PlacedBox& b, const Vector& direction) {
  constexpr Scalar kFar = std::numeric_limits<Scalar>::max();
  Overlap stretch{-kFar, kFar};
  const Vector apart = b.centre - a.centre;
  for (const Matrix* axes : {&a.axes, &b.axes}) {
    for (int k = 0; k < 3; ++k) {
      const Vector axis = axes->col(k);
      const Scalar reach = a.reach(axis) + b.reach(axis);
      const Scalar from = axis.dot(apart) - reach;
      const Scalar speed = axis.dot(direction);
      if (std::abs(speed) < Scalar(1e-6)) {
        if (from >= 0 || from + 2 * reach <= 0) return {kFar, -kFar};
        continue;
      }
      const Scalar t0 = from / speed;
      const Scalar t1 = (from + 2 * reach) / speed;
      stretch.first = std::max(stretch.first, std::min(t0, t1));
      stretch.second = std::min(stretch.second, std::max(t0, t1));
    }
  }
  return stretch;
}

class OneWay {
 public:
  OneWay(const Body& a, const Body& b) : a_(a), b_(b), offset_(b.pose.position - a.pose.position) {}

  // Whether parts are deep in each other, and some are in the way of others.
  bool is_jammed(const std::vector<ContactPatch>& patches) const {
    if (std::none_of(patches.begin(), patches.end(), [&](const ContactPatch& p) { return is_deep(p); }))
      return false;
    return std::any_of(patches.begin(), patches.end(), [&](const ContactPatch& patch) {
      return std::any_of(patches.begin(), patches.end(), [&](const ContactPatch& other) {
        return other.normal.dot(patch.normal) < kAgainst;
      });
    });
  }

  void open(std::vector<ContactPatch>& patches) {
    for (const Part& part : a_.solid->parts()) {
      if (part.convex) boxes_a_.emplace_back(a_, part, Vector::Zero());
    }
    for (const Part& part : b_.solid->parts()) {
      if (part.convex) boxes_b_.emplace_back(b_, part, offset_);
    }
    add_candidates(patches);
    Vector direction = candidates_.front();
    Scalar least = std::numeric_limits<Scalar>::max();
    for (const Vector& candidate : candidates_) {
      const Scalar way = way_out(candidate, least);
      if (way >= least * (1 - kShorter)) continue;
      least = way;
      direction = candidate;
    }
    std::vector<ContactPatch> kept;
    for (ContactPatch& patch : patches) {
      if (is_deep(patch)) {
        kept.push_back(along(direction, patch));
      } else if (patch.normal.dot(direction) > kBlocks) {
        kept.push_back(patch);
      }
    }
    hold_opposite(kept);
    patches = std::move(kept);
  }

 private:
  // What presses from opposite sides can open by no more than what one of them is deeper.
  void hold_opposite(std::vector<ContactPatch>& patches) const {
    std::vector<Scalar> held(patches.size(), Scalar(0));
    for (std::size_t n = 0; n < patches.size(); ++n) {
      for (const ContactPatch& other : patches) {
        if (other.normal.dot(patches[n].normal) < kAgainst) held[n] = std::max(held[n], depth_of(other));
      }
      held[n] = std::min(held[n], depth_of(patches[n]));
    }
    for (std::size_t n = 0; n < patches.size(); ++n) {
      const Vector way = a_.pose.rotation.transpose() * patches[n].normal * held[n];
      for (int k = 0; k < patches[n].count; ++k) {
        patches[n].point[k].gap += held[n];
        patches[n].point[k].on_a += way;
      }
    }
  }

  const Part& part_of_a(const ContactPatch& patch) const { return a_.solid->parts()[patch.parts >> 32]; }
  const Part& part_of_b(const ContactPatch& patch) const {
    return b_.solid->parts()[patch.parts & 0xffffffff];
  }

  bool is_deep(const ContactPatch& patch) const {
    const Part& p = part_of_a(patch);
    const Part& q = part_of_b(patch);
    if (!p.convex || !q.convex) return false;
    const Scalar thin =
        std::min((p.bounds.high - p.bounds.low).minCoeff(), (q.bounds.high - q.bounds.low).minCoeff());
    return depth_of(patch) > kDeepShare * thin;
  }

  void add_candidates(const std::vector<ContactPatch>& patches) {
    const auto add = [&](const Vector& direction) {
      for (const Vector& known : candidates_) {
        if (known.dot(direction) > kSameDirection) return;
      }
      candidates_.push_back(direction);
    };
    for (const ContactPatch& patch : patches) {
      if (is_deep(patch)) add(patch.normal);
    }
    for (const Body* body : {&a_, &b_}) {
      for (int k = 0; k < 3; ++k) {
        add(body->pose.rotation.col(k));
        add(-body->pose.rotation.col(k));
      }
    }
  }

  // How far a goes along a direction until no part of it is in one of b; of no meaning beyond `enough`.
  Scalar way_out(const Vector& direction, Scalar enough) {
    stretches_.clear();
    for (const PlacedBox& p : boxes_a_) {
      for (const PlacedBox& q : boxes_b_) {
        const Overlap stretch = overlap_along(p, q, direction);
        if (stretch.first < stretch.second && stretch.second > 0 && stretch.first < enough)
          stretches_.push_back(stretch);
      }
    }
    std::sort(stretches_.begin(), stretches_.end());
    Scalar way = 0;
    for (const Overlap& stretch : stretches_) {
      if (stretch.first > way) break;
      way = std::max(way, stretch.second);
    }
    return way;
  }

  // The two parts of a patch, pushed apart along a direction in the middle of where they overlap.
  ContactPatch along(const Vector& direction, const ContactPatch& patch) const {
    const Part& p = part_of_a(patch);
    const Part& q = part_of_b(patch);
    const PlacedBox box_a(a_, p, Vector::Zero());
    const PlacedBox box_b(b_, q, offset_);
    Vector middle;
    for (int k = 0; k < 3; ++k) {
      const Scalar reach_a = box_a.reach(Vector::Unit(k));
      const Scalar reach_b = box_b.reach(Vector::Unit(k));
      middle[k] = (std::max(box_a.centre[k] - reach_a, box_b.centre[k] - reach_b) +
                   std::min(box_a.centre[k] + reach_a, box_b.centre[k] + reach_b)) /
                  2;
    }
    const auto height = [&](const Body& body, const Part& part, const Vector& centre, const Vector& towards) {
      const Frame at = body.pose * part.frame;
      const Vector point = at.rotation * farthest(part, Vector(at.rotation.transpose() * towards));
      return direction.dot(centre + body.pose.rotation * part.frame.position + point);
    };
    const Scalar of_a = height(a_, p, Vector::Zero(), Vector(-direction));
    const Scalar of_b = height(b_, q, offset_, direction);
    const Vector foot = middle - direction * direction.dot(middle);
    ContactPatch opened;
    opened.parts = patch.parts;
    opened.normal = direction;
    opened.fixed_normal = b_.pose.rotation.transpose() * direction;
    opened.count = 1;
    opened.point[0] = {a_.pose.rotation.transpose() * Vector(foot + direction * of_a),
                       b_.pose.rotation.transpose() * Vector(foot + direction * of_b - offset_), of_a - of_b,
                       0, kOneWayFeature};
    return opened;
  }

  const Body& a_;
  const Body& b_;
  const Vector offset_;
  absl::InlinedVector<PlacedBox, 8> boxes_a_;
  absl::InlinedVector<PlacedBox, 8> boxes_b_;
  absl::InlinedVector<Vector, 16> candidates_;
  std::vector<Overlap> stretches_;
};

}  // namespace

void open_one_way(const Body& a, const Body& b, std::vector<ContactPatch>& patches) {
  if (patches.size() < 2) return;
  OneWay way(a, b);
  if (way.is_jammed(patches)) way.open(patches);
}

}  // namespace tessera::native
