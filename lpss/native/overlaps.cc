#include "lpss/native/overlaps.h"

#include <algorithm>
#include <utility>

#include "lpss/native/moving_probe.h"
#include "lpss/native/narrow_phase.h"
#include "lpss/native/round_shapes.h"

namespace tessera::native {
namespace {

using Kind = Part::Kind;
using collision::Placement;

bool is_convex(const Part& part) { return part.kind != Kind::kPlane && part.kind != Kind::kTerrain; }

Frame posed(const Part& part, const Frame& at) { return part.is_placed ? at * part.frame : at; }

ExactFrame posed(const Part& part, const ExactFrame& at) {
  return part.is_placed ? at * ExactFrame(part.frame) : at;
}

// m, of a part; 0 for surfaces.
Scalar thickness(const Part& part) {
  if (part.kind == Kind::kTerrain) return 0;
  return (part.bounds.high - part.bounds.low).minCoeff();
}

bool may_notice(const Sensor& sensor, const Part& trigger, const Body& visitor, const Part& part) {
  const Material* const own = trigger.material.get();
  const Material* const its = part.material.get();
  const auto [category, mask] =
      own ? std::pair(own->category, own->mask) : std::pair(sensor.category, sensor.mask);
  const auto [other_category, other_mask] =
      its ? std::pair(its->category, its->mask) : std::pair(visitor.category, visitor.mask);
  return (category & other_mask) != 0 && (other_category & mask) != 0;
}

// A ball so large beside the other that numbers of the engine, relative to its centre, are too coarse.
bool is_huge(const Part& part, const Part& other) {
  constexpr Scalar kHuge = 1024;
  return part.kind == Kind::kBall && part.ball.radius > kHuge * thickness(other);
}

// The first one is convex.
bool overlap(const Part& convex, const Frame& at, const Part& other, const Frame& other_at) {
  if (is_convex(other)) return distance(convex, at, other, other_at, 0) < 0;
  if (other.kind == Kind::kPlane) {
    const Vector up = other_at.rotation * other.normal;
    const Vector lowest = at * farthest(convex, Vector(at.rotation.transpose() * -up));
    return up.dot(lowest - other_at.position) < 0;
  }
  const Frame seen{other_at.rotation.transpose() * at.rotation, other_at.inverse(at.position)};
  Terrain::List triangles;
  other.terrain->near(convex.bounds.posed(seen), triangles);
  return std::ranges::any_of(triangles, [&](const Terrain::Found& found) {
    return distance(convex, at, found.triangle, other_at, 0) < 0;
  });
}

}  // namespace

Frame frame_of(const Body& body, const Solid& solid) {
  if (!body.static_state) return body.pose;
  const BodyState& state = *body.static_state;
  return Frame{matrix(state.rotation), vector(state.position)} * solid.offset();
}

Bounds sensor_bounds(const Body& body) {
  const Sensor& sensor = *body.sensor;
  Bounds bounds = sensor.triggers->bounds_at(frame_of(body, *sensor.triggers));
  if (sensor.others) bounds.extend(sensor.others->bounds_at(frame_of(body, *sensor.others)));
  return bounds;
}

template <typename Test>
bool OverlapSearch::any_pair(const Body& trigger, const Body& visitor, const Vector& way, const Test& test) {
  const Sensor& sensor = *trigger.sensor;
  if (any_pair(*sensor.triggers, trigger, visitor, way, test)) return true;
  return sensor.others && any_pair(*sensor.others, trigger, visitor, way, test);
}

template <typename Test>
bool OverlapSearch::any_pair(const Solid& triggers, const Body& trigger, const Body& visitor,
                             const Vector& way, const Test& test) {
  const Frame at = frame_of(trigger, triggers);
  // Boxes of hulls and planes are rounded.
  constexpr Scalar kRounding = Scalar(1e-3);  // m
  const auto seen = [](const Bounds& bounds, const Frame& by) {
    return bounds.posed({by.rotation.transpose(), by.inverse(Vector(Vector::Zero()))}).grown(kRounding);
  };
  Bounds reach = visitor.solid->bounds_at(visitor.pose);
  reach.extend(reach.moved(way));
  triggers.parts_near(seen(reach, at), triggers_);
  for (const std::uint32_t i : triggers_) {
    const Part& p = triggers.parts()[i];
    Bounds bounds = bounds_at(p, at);
    bounds.extend(bounds.moved(-way));
    visitor.solid->parts_near(seen(bounds, visitor.pose), parts_);
    for (const std::uint32_t j : parts_) {
      const Part& q = visitor.solid->parts()[j];
      if (!is_convex(p) && !is_convex(q)) continue;
      if (may_notice(*trigger.sensor, p, visitor, q) && test(triggers, p, q)) return true;
    }
  }
  return false;
}

bool OverlapSearch::overlaps(const Body& trigger, const Body& visitor) {
  return any_pair(trigger, visitor, Vector::Zero(), [&](const Solid& triggers, const Part& p, const Part& q) {
    if (is_huge(p, q) || is_huge(q, p)) {
      const ExactFrame p_at = posed(p, exact_frame_of(trigger, triggers));
      const ExactFrame q_at = posed(q, exact_frame_of(visitor));
      const bool moves_q = is_convex(q);
      MovingProbe probe(moves_q ? q : p, moves_q ? q_at : p_at, {Eigen::Vector3d::UnitX(), 0});
      return probe.meets(moves_q ? p : q, moves_q ? p_at : q_at);
    }
    const Frame p_at = posed(p, frame_of(trigger, triggers));
    const Frame q_at = posed(q, visitor.pose);
    return is_convex(p) ? overlap(p, p_at, q, q_at) : overlap(q, q_at, p, p_at);
  });
}

bool OverlapSearch::meets(const Body& trigger, const Body& visitor, const Vector& way) {
  constexpr Scalar kFar = Scalar(0.5);
  const Scalar length = way.norm();
  const Eigen::Vector3d direction = way.cast<double>().normalized();
  return any_pair(trigger, visitor, way, [&](const Solid& triggers, const Part& p, const Part& q) {
    if (!(length > kFar * std::max(thickness(p), thickness(q)))) return false;
    const ExactFrame p_at = posed(p, exact_frame_of(trigger, triggers));
    const ExactFrame q_at = posed(q, exact_frame_of(visitor));
    if (is_convex(q)) return MovingProbe(q, q_at, {direction, double(length)}).meets(p, p_at);
    return MovingProbe(p, p_at, {-direction, double(length)}).meets(q, q_at);
  });
}

}  // namespace tessera::native
