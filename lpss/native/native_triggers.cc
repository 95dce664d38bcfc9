// What is in triggers. A function of where bodies are and how they move at the beginning of a tick, and of
// nothing before.
#include <algorithm>

#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// Whether a world with both looks after them: the home of the dynamic one, or of either.
bool detects(const Body& a, const Body& b) {
  const bool neither = a.is_dynamic() == b.is_dynamic();
  const bool a_counts = neither || a.is_dynamic();
  const bool b_counts = neither || b.is_dynamic();
  return (a_counts && a.lives_here()) || (b_counts && b.lives_here());
}

Bounds along(const Bounds& bounds, const Vector& way) {
  Bounds swept = bounds;
  swept.extend(bounds.moved(way));
  return swept;
}

}  // namespace

// Once the body is in the world.
void NativeWorld::add_sensor(BodySlot slot, const std::shared_ptr<const BodyForm>& form, bool is_whole) {
  std::shared_ptr<const Solid> triggers = BodyForm::triggers_of(form);
  if (!triggers && !is_whole) return;
  Body& sensing = body(slot);
  Sensor sensor;
  sensor.is_whole = is_whole || form->are_all_triggers();
  if (is_whole && triggers && !form->are_all_triggers()) sensor.others = sensing.solid;
  sensor.triggers = triggers ? std::move(triggers) : sensing.solid;
  sensing.set_sensor(std::move(sensor));
  const auto by_id = [&](BodySlot other, BodyId id) { return body(other).id < id; };
  sensors_.insert(std::lower_bound(sensors_.begin(), sensors_.end(), sensing.id, by_id), slot);
}

bool NativeWorld::reaches_sensor_of_home(const Bounds& bounds) const {
  const auto dt = Scalar(settings_.time_step);
  return std::ranges::any_of(sensors_, [&](BodySlot slot) {
    const Body& sensing = body(slot);
    if (!sensing.lives_here()) return false;
    return bounds.overlaps(swept(sensing, sensor_bounds(sensing), dt));
  });
}

bool NativeWorld::may_be_in(const Body& visitor, const Body& trigger) const {
  if (visitor.id == trigger.id || (visitor.sensor && visitor.sensor->is_whole)) return false;
  if (!detects(trigger, visitor)) return false;
  if (trigger.assembly != 0 && trigger.assembly == visitor.assembly) return false;
  return !is_found_elsewhere(trigger, visitor) && !engine_.are_apart(trigger.id, visitor.id);
}

// m, in this tick, until it hits something.
Vector NativeWorld::way_ahead(BodySlot slot) const {
  const Body& moving = body(slot);
  Vector way = way_in_tick(moving);
  if (!moving.is_dynamic() || !moving.is_awake() || !is_swept(moving)) return way;
  const std::optional<SweepHit> hit = sweep(slot, /*without_clones=*/false);
  return hit ? Vector(way * hit->fraction) : way;
}

bool NativeWorld::is_in(BodySlot visitor_slot, BodySlot trigger_slot, std::span<const Overlap> before) {
  const Body& trigger = body(trigger_slot);
  const Body& visitor = body(visitor_slot);
  const bool rests = !trigger.is_awake() && !visitor.is_awake();
  if (rests && std::ranges::binary_search(before, Overlap{trigger.id, visitor.id})) return true;
  if (overlap_search_.overlaps(trigger, visitor)) return true;
  if (rests || !settings_.continuous_collision) return false;
  const Vector way = way_in_tick(visitor) - way_in_tick(trigger);
  if (way.isZero(0) || !overlap_search_.meets(trigger, visitor, way)) return false;
  // What stops short of the trigger does not get there.
  const Vector left = way_ahead(visitor_slot) - way_ahead(trigger_slot);
  return left == way || (!left.isZero(0) && overlap_search_.meets(trigger, visitor, left));
}

void NativeWorld::find_overlaps(std::span<const Overlap> before, std::vector<Overlap>& now) {
  now.clear();
  if (sensors_.empty()) return;
  // Boxes of dynamic bodies hold their ways.
  Scalar kinematic_way = 0;
  for (const BodySlot slot : kinematics_)
    kinematic_way = std::max(kinematic_way, way_in_tick(body(slot)).norm());
  for (const BodySlot trigger_slot : sensors_) {
    const Body& trigger = body(trigger_slot);
    const Bounds reach = along(sensor_bounds(trigger), way_in_tick(trigger));
    near_sensor_.clear();
    broad_phase_.for_each_in(reach.grown(kinematic_way), [&](BodySlot slot) {
      const Body& visitor = body(slot);
      const bool moves = visitor.motion == Motion::kKinematic;
      const Bounds bounds = moves ? along(visitor.bounds, way_in_tick(visitor)) : visitor.bounds;
      if (reach.overlaps(bounds) && may_be_in(visitor, trigger)) near_sensor_.push_back(slot);
    });
    std::ranges::sort(near_sensor_, {}, [&](BodySlot slot) { return body(slot).id; });
    for (const BodySlot slot : near_sensor_) {
      if (is_in(slot, trigger_slot, before)) now.push_back({trigger.id, body(slot).id});
    }
  }
}

}  // namespace tessera::native
