// Wander: has a character on the same body walk from goal to goal around the place where it started.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "lpss/base/portable_math.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace wander {
namespace {

enum class Parameter { kRadius, kSpeed, kPause, kLook, kCharacter };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"radius", "m", 10, 0, 1e4, "How far its goals are from where it started, at most."},
    {"speed", "m/s", 1.4, 0, 100, "Of its walk."},
    {"pause", "s", 2, 0, 1e6, "How long it stands at a goal, at most."},
    {"look", "s", 0.25, 0.001, 10,
     "How often it looks where it is going; it gives a goal up after a minute."},
    {"character", "", 0, 0, static_cast<double>(kProgramsPerBodyMax - 1),
     "The place of the character on the body."},
});

enum class Value { kX, kY, kUntil, kGoals };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"x", "m", 0, 0, 0, "The goal of its last walk, from where it started, along the world's axes."},
    {"y", "m", 0, 0, 0, "Likewise."},
    {"until", "", 0, 0, 0, "A tick: until then it stands, or tries to reach the goal."},
    {"goals", "", 0, 0, 0, "How many goals it has had."},
});

constexpr double kArrived = 0.5;  // m
constexpr double kPatience = 60;  // s

class Wander final : public Program {
 public:
  absl::string_view kind() const override { return "wander"; }
  absl::string_view summary() const override {
    return "Has the character of its body walk from goal to goal around the place where it started.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const auto every = static_cast<std::uint64_t>(
        std::max(1.0, std::round(at(senses.parameters, Parameter::kLook) / senses.dt)));
    // Instances look at different ticks.
    if ((senses.tick + senses.body.value) % every != 0) {
      actor.wake_in(every - (senses.tick + senses.body.value) % every);
      return;
    }
    actor.wake_in(every);
    const Eigen::Vector3d way =
        senses.start + Eigen::Vector3d(at(values, Value::kX), at(values, Value::kY), 0) - senses.position();
    const double distance = portable::hypot(way.x(), way.y());
    const auto now = static_cast<double>(senses.tick);
    const bool is_late = now >= at(values, Value::kUntil);
    const bool walks = is_walk(at(values, Value::kGoals));
    if (walks && !is_late && distance > kArrived) return walk(senses, way, distance, actor);
    if (!walks && !is_late && at(values, Value::kGoals) > 0) return;
    choose(senses, values);
    if (!is_walk(at(values, Value::kGoals))) tell(senses, actor, 0, 0, {});
  }

 private:
  // Walks and pauses take turns.
  static bool is_walk(double goals) { return std::fmod(goals, 2) == 1; }

  // A new goal, evenly over the disc, or a pause.
  static void choose(const Senses& senses, std::span<double> values) {
    double& goals = at(values, Value::kGoals);
    goals += 1;
    const bool pauses = !is_walk(goals);
    const double lasts = pauses ? at(senses.parameters, Parameter::kPause) * senses.random(0) : kPatience;
    at(values, Value::kUntil) = static_cast<double>(senses.tick) + lasts / senses.dt;
    if (pauses) return;
    const double radius = at(senses.parameters, Parameter::kRadius) * std::sqrt(senses.random(1));
    const auto [sin, cos] = portable::sincos(2 * std::numbers::pi * senses.random(2));
    at(values, Value::kX) = radius * cos;
    at(values, Value::kY) = radius * sin;
  }

  static void walk(const Senses& senses, const Eigen::Vector3d& way, double distance, Actor& actor) {
    const double speed = at(senses.parameters, Parameter::kSpeed);
    tell(senses, actor, speed * way.x() / distance, speed * way.y() / distance,
         portable::atan2(way.y(), way.x()));
  }

  static void tell(const Senses& senses, Actor& actor, double x, double y, std::optional<double> heading) {
    const auto place = static_cast<std::uint32_t>(at(senses.parameters, Parameter::kCharacter));
    const Program& character = character_program();
    TellProgram told{senses.body, place, {}, {}};
    const auto set = [&](absl::string_view name, double value) {
      told.inputs.emplace_back(*place_of(name, character.inputs()), value);
    };
    set("x", x);
    set("y", y);
    if (heading) set("heading", *heading);
    actor.tell(std::move(told));
  }
};

}  // namespace
}  // namespace wander

const Program& wander_program() {
  static const wander::Wander kWander;
  return kWander;
}

}  // namespace tessera
