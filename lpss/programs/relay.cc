// Relay: tells another program something when a value of a program of its body comes into a range.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/measuring.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace relay {
namespace {

constexpr double kPlaceMax = kProgramNumbersMax - 1;
constexpr double kNumberMax = 1e9;
constexpr double kValueMax = 1e16;

enum class Parameter { kProgram, kValue, kLeast, kMost, kDelay, kBody, kToProgram, kInput, kCount, kTo };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"program", kProgramUnit, -1, -1, kProgramsPerBodyMax - 1.0,
     "The place of the program of its body that it watches; -1: none, and it only waits to be told."},
    {"value", kValueUnit, 0, 0, kPlaceMax, "The place of the value that it watches."},
    {"least", "", 1, -kValueMax, kValueMax, "It acts when the value comes to be at least this"},
    {"most", "", kValueMax, -kValueMax, kValueMax, "and at most this."},
    {"delay", "s", 0, 0, 1e6, "How long after that. What happens in the meantime does not count."},
    {"body", kBodyUnit, 0, 0, static_cast<double>(kBodyIdMax), "Whose program it tells; 0: nobody's."},
    {"to_program", kProgramUnit, 0, 0, kProgramsPerBodyMax - 1.0, "The place of that program on its body."},
    {"input", kInputUnit, 0, 0, kPlaceMax, "The place of the first input that it sets."},
    {"count", "", 1, 1, 6, "How many inputs it sets."},
    {"to_1", "", 1, -kNumberMax, kNumberMax, "What the first one is set to,"},
    {"to_2", "", 0, -kNumberMax, kNumberMax, "the second one,"},
    {"to_3", "", 0, -kNumberMax, kNumberMax, "the third one,"},
    {"to_4", "", 0, -kNumberMax, kNumberMax, "the fourth one,"},
    {"to_5", "", 0, -kNumberMax, kNumberMax, "the fifth one,"},
    {"to_6", "", 0, -kNumberMax, kNumberMax, "and the sixth one."},
});

enum class Input { kFire };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"fire", "", 0, 0, 1, "1: as if the value had come into the range. It becomes 0 again."},
});

enum class Value { kInside, kDue, kActs };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"inside", "", 0, 0, 0, "1 while the value is in the range."},
    {"due", "tick", 0, 0, 0, "When it acts; 0: nothing has happened."},
    {"acts", "", 0, 0, 0, "How often it has acted."},
});

std::uint64_t place(const Senses& senses, Parameter parameter) {
  return static_cast<std::uint64_t>(at(senses.parameters, parameter));
}

class Relay final : public Program {
 public:
  absl::string_view kind() const override { return "relay"; }
  absl::string_view summary() const override {
    return "Sets inputs of another program when a value of a program of its body comes into a range, or when "
           "it is told to.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  bool reads_others() const override { return true; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const bool is_told = at(senses.inputs, Input::kFire) >= 0.5;
    double& inside = at(values, Value::kInside);
    const bool was_inside = inside > 0;
    inside = is_inside(senses, actor) ? 1 : 0;
    double& due = at(values, Value::kDue);
    const auto now = static_cast<double>(senses.tick);
    if (due == 0 && (is_told || (inside > 0 && !was_inside)))
      due = now + std::round(at(senses.parameters, Parameter::kDelay) / senses.dt);
    if (is_told) actor.tell({senses.body, senses.program, {{0, 0}}, {}});
    if (watches(senses)) keep_measuring(senses, actor);
    if (due == 0) return;
    if (due > now) {
      if (!watches(senses) || senses.properties.motion != Motion::kKinematic)
        actor.wake_in(static_cast<std::uint64_t>(due - now));
      return;
    }
    due = 0;
    at(values, Value::kActs) += 1;
    act(senses, actor);
  }

 private:
  static bool watches(const Senses& senses) { return at(senses.parameters, Parameter::kProgram) >= 0; }

  static bool is_inside(const Senses& senses, Actor& actor) {
    if (!watches(senses)) return false;
    const std::uint64_t watched = place(senses, Parameter::kProgram);
    if (watched >= senses.programs.size()) {
      actor.fail(absl::StrCat("its body has no program ", watched));
      return false;
    }
    const ProgramRecord& record = senses.programs[watched];
    const Program* const program = find_program(record.kind);
    if (program == nullptr || program->reads_others()) {
      actor.fail(absl::StrCat("program ", watched, ", ", record.kind, ", reads others itself"));
      return false;
    }
    const std::uint64_t value = place(senses, Parameter::kValue);
    if (value >= record.values.size()) {
      actor.fail(absl::StrCat("program ", watched, ", ", record.kind, ", has no value ", value));
      return false;
    }
    const double now = record.values[value];
    return now >= at(senses.parameters, Parameter::kLeast) && now <= at(senses.parameters, Parameter::kMost);
  }

  static void act(const Senses& senses, Actor& actor) {
    const BodyId body{place(senses, Parameter::kBody)};
    if (body.value == 0) return;
    TellProgram told{body, static_cast<std::uint32_t>(place(senses, Parameter::kToProgram)), {}, {}};
    const auto first = static_cast<std::uint32_t>(place(senses, Parameter::kInput));
    const auto count = static_cast<std::uint32_t>(place(senses, Parameter::kCount));
    for (std::uint32_t n = 0; n < count; ++n)
      told.inputs.emplace_back(first + n, (&at(senses.parameters, Parameter::kTo))[n]);
    actor.tell(std::move(told));
  }
};

}  // namespace
}  // namespace relay

const Program& relay_program() {
  static const relay::Relay kRelay;
  return kRelay;
}

}  // namespace tessera
