// Pad: tells another program whether something is in the triggers of its body, as a plate opens a door.
#include <algorithm>
#include <array>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace pad {
namespace {

enum class Parameter { kBody, kProgram, kInput, kInside, kOutside };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"body", kBodyUnit, 0, 0, static_cast<double>(kBodyIdMax), "Whose program is told; 0: nobody's."},
    {"program", kProgramUnit, 0, 0, static_cast<double>(kProgramsPerBodyMax - 1),
     "The place of that program on its body."},
    {"input", kInputUnit, 0, 0, static_cast<double>(kProgramNumbersMax - 1),
     "The place of the input that is set."},
    {"inside", "", 1, -1e9, 1e9, "What it is set to when something comes in,"},
    {"outside", "", 0, -1e9, 1e9, "and when nothing is in any longer."},
});

enum class Value { kCount };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"count", "", 0, 0, 0, "How many bodies that can move are in."},
});

class Pad final : public Program {
 public:
  absl::string_view kind() const override { return "pad"; }
  absl::string_view summary() const override {
    return "Sets an input of another program while something is in the triggers of its body.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    asker.inside(senses.body);
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    double& count = at(values, Value::kCount);
    const bool was_in = count > 0;
    count = static_cast<double>(std::ranges::count_if(
        senses.of(0), [](const ProgramFinding& found) { return found.motion != Motion::kStatic; }));
    const bool is_in = count > 0;
    const auto place = [&](Parameter p) { return static_cast<std::uint64_t>(at(senses.parameters, p)); };
    if (is_in == was_in || place(Parameter::kBody) == 0) return;
    const double value = at(senses.parameters, is_in ? Parameter::kInside : Parameter::kOutside);
    actor.tell({BodyId{place(Parameter::kBody)},
                static_cast<std::uint32_t>(place(Parameter::kProgram)),
                {{static_cast<std::uint32_t>(place(Parameter::kInput)), value}},
                {}});
  }
};

}  // namespace
}  // namespace pad

const Program& pad_program() {
  static const pad::Pad kPad;
  return kPad;
}

}  // namespace tessera
