#include "simulator/any_program.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "lpss/programs/registry.h"
#include "simulator/late_module.h"

namespace tessera {
namespace {

constexpr double kUsuallyNear = 1;  // most numbers are no farther from what they are at first
constexpr double kNowAndThen = 30;

}  // namespace

AnyProgram::AnyProgram(Dice& dice, const KnownWorld& world, Number number)
    : dice_(dice), world_(world), number_(std::move(number)), kinds_(programs().begin(), programs().end()) {
  const ProgramModules& modules = world.settings.modules;
  for (const auto& module : modules) kinds_.push_back(find_program(module->kind));
  if (late_module() && std::ranges::find(modules, late_module()) == modules.end())
    kinds_.push_back(find_program(late_module()->kind));
}

v1::Program AnyProgram::for_body(v1::Motion motion, std::uint64_t bodies, std::uint64_t joints) {
  BodyProperties properties;
  properties.motion = motion == v1::MOTION_KINEMATIC ? Motion::kKinematic : Motion::kDynamic;
  std::vector<const Program*> suitable;
  std::ranges::copy_if(kinds_, std::back_inserter(suitable),
                       [&](const Program* one) { return one->check(properties).ok(); });
  const Program& kind = *suitable[dice_.below(suitable.size())];
  v1::Program program;
  program.set_kind(std::string(kind.kind()));
  const auto id = [&](const NumberSpec& spec) {
    return dice_.below((spec.unit == kBodyUnit ? bodies : joints) + 1);
  };
  fill(kind, id, *program.mutable_numbers());
  return program;
}

v1::TellProgram AnyProgram::told() {
  const KnownWorld::ProgramOf& known = world_.programs[dice_.below(world_.programs.size())];
  v1::TellProgram told;
  told.mutable_body()->set_id(known.body);
  told.set_program(known.place);
  if (const Program* const kind = find_program(known.kind))
    fill(
        *kind, [this](const NumberSpec& spec) { return known_id(spec); }, *told.mutable_numbers());
  return told;
}

void AnyProgram::tell_any(Numbers& numbers) {
  fill(
      *kinds_[dice_.below(kinds_.size())], [this](const NumberSpec& spec) { return known_id(spec); },
      numbers);
}

std::uint64_t AnyProgram::known_id(const NumberSpec& spec) {
  const auto one_of = [this](const auto& all) -> std::uint64_t {
    if (all.empty() || dice_.one_in(8)) return 0;
    return all[dice_.below(all.size())].id;
  };
  return spec.unit == kBodyUnit ? one_of(world_.bodies) : one_of(world_.joints);
}

void AnyProgram::fill(const Program& program, const Id& id, Numbers& numbers) {
  for (const auto table : {program.parameters(), program.inputs()}) {
    for (const NumberSpec& spec : table) {
      if (dice_.one_in(2)) continue;
      v1::NamedNumber& number = *numbers.Add();
      number.set_name(std::string(spec.name));
      number.set_value(is_id(spec) ? static_cast<double>(id(spec)) : number_(spec));
    }
  }
}

double usual_number(Dice& dice, const NumberSpec& spec) {
  const double far = dice.one_in(4) ? kNowAndThen : kUsuallyNear;
  return std::clamp(spec.first * dice.between(0.5, 1.5) + dice.between(-far, far), spec.least, spec.most);
}

}  // namespace tessera
