#include "lpss/programs/registry.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "lpss/base/utf8.h"
#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/module.h"

namespace tessera {
namespace {

// Each instance runs once its body is there, which may sleep from the start.
constexpr std::uint64_t kAtOnce = 1;

std::string title_of(const ProgramRecord& record, absl::string_view name) {
  return absl::StrCat("program ", record.kind, ": ", name);
}

absl::Status within_table(const ProgramRecord& record, std::span<const double> numbers,
                          std::span<const NumberSpec> table) {
  if (numbers.size() > table.size())
    return refused(title_of(record, ""), numbers.size(), " numbers must be at most ", table.size());
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    const NumberSpec& spec = table[n];
    if (absl::Status status = check_number(spec, numbers[n]); !status.ok())
      return in(absl::StrCat("program ", record.kind), status);
  }
  return absl::OkStatus();
}

// Values are a program's own, and may leave their usual bounds; they must be numbers.
absl::Status check_values(const ProgramRecord& record, std::span<const NumberSpec> table) {
  if (record.values.size() > table.size())
    return refused(title_of(record, ""), record.values.size(), " values must be at most ", table.size());
  for (std::size_t n = 0; n < record.values.size(); ++n) {
    if (!std::isfinite(record.values[n]))
      return refused(title_of(record, table[n].name), " = ", record.values[n], " must be finite");
  }
  return absl::OkStatus();
}

const Program* find_builtin(absl::string_view kind) {
  const auto found =
      std::ranges::lower_bound(programs(), kind, {}, [](const Program* p) { return p->kind(); });
  return found == programs().end() || (*found)->kind() != kind ? nullptr : *found;
}

void complete(std::vector<double>& numbers, std::span<const NumberSpec> table) {
  for (std::size_t n = numbers.size(); n < table.size(); ++n) numbers.push_back(table[n].first);
  numbers.resize(table.size());
}

// Of what the process knows, a world has its own modules alone.
bool has_program(const ProgramModules& modules, absl::string_view kind) {
  return find_builtin(kind) != nullptr ||
         std::ranges::any_of(modules, [&](const auto& module) { return module->kind == kind; });
}

absl::Status check_program(const ProgramRecord& record, const ProgramModules& modules) {
  if (std::max({record.kind.size(), record.fault.size(), record.name.size()}) > kProgramTextBytesMax)
    return refused("the texts of a program must have at most ", kProgramTextBytesMax, " bytes");
  if (!is_utf8(record.name)) return refused("the name of a program must be UTF-8");
  const Program* const program = find_program(record.kind);
  if (program == nullptr) return new_program(record.kind).status();
  if (!has_program(modules, record.kind))
    return refused(title_of(record, ""), "the world does not have its module");
  if (absl::Status status = within_table(record, record.parameters, program->parameters()); !status.ok())
    return status;
  if (absl::Status status = within_table(record, record.inputs, program->inputs()); !status.ok())
    return status;
  if (absl::Status status = check_values(record, program->values()); !status.ok()) return status;
  return in(title_of(record, "start"), finite("position", Eigen::Vector3d(record.start.data())));
}

}  // namespace

std::span<const Program* const> programs() {
  static const auto kPrograms = builtin_programs();
  return kPrograms;
}

const Program* find_program(absl::string_view kind) {
  const Program* const builtin = find_builtin(kind);
  return builtin != nullptr ? builtin : find_module(kind).get();
}

std::optional<std::uint32_t> place_of(absl::string_view name, std::span<const NumberSpec> table) {
  const auto found = std::ranges::find(table, name, &NumberSpec::name);
  if (found == table.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - table.begin());
}

const NumberSpec* find_spec(const Program& program, absl::string_view name) {
  for (const auto table : {program.parameters(), program.inputs()}) {
    if (const auto place = place_of(name, table)) return &table[*place];
  }
  return nullptr;
}

std::string no_number(const Program& program, absl::string_view name) {
  std::vector<absl::string_view> names;
  for (const auto table : {program.parameters(), program.inputs()}) {
    for (const NumberSpec& spec : table) names.push_back(spec.name);
  }
  return absl::StrCat("program ", program.kind(), " has no number '", name.substr(0, kProgramTextBytesMax),
                      "'; it has: ", absl::StrJoin(names, ", "));
}

absl::StatusOr<ProgramRecord> new_program(absl::string_view kind) {
  const Program* const program = find_program(kind);
  if (program == nullptr && absl::StrContains(kind, '@'))
    return absl::NotFoundError(absl::StrCat("there is no program \"", kind.substr(0, kProgramTextBytesMax),
                                            "\": no world here has its module"));
  if (program == nullptr) {
    const auto append_kind = [](std::string* text, const Program* p) { absl::StrAppend(text, p->kind()); };
    return absl::NotFoundError(absl::StrCat("there is no program \"", kind.substr(0, kProgramTextBytesMax),
                                            "\"; there are: ", absl::StrJoin(programs(), ", ", append_kind)));
  }
  ProgramRecord record;
  record.kind = std::string(program->kind());
  record.wake_at = kAtOnce;
  complete(record);
  return record;
}

absl::Status set_number(ProgramRecord& record, absl::string_view name, double value) {
  const Program* const program = find_program(record.kind);
  if (program == nullptr) return new_program(record.kind).status();
  if (const auto parameter = place_of(name, program->parameters())) {
    record.parameters[*parameter] = value;
    complete(record);  // some say how many values there are
  } else if (const auto input = place_of(name, program->inputs())) {
    record.inputs[*input] = value;
  } else {
    return refused(no_number(*program, name));
  }
  return absl::OkStatus();
}

void complete(ProgramRecord& record) {
  const Program* const program = find_program(record.kind);
  if (program == nullptr) return;
  complete(record.parameters, program->parameters());
  complete(record.inputs, program->inputs());
  complete(record.values, program->values().first(program->value_count(record.parameters)));
}

absl::Status check_number(const NumberSpec& spec, double value) {
  const std::string name(spec.name);
  if (absl::Status status = bounded(name, value, spec.least, spec.most, spec.unit); !status.ok())
    return status;
  if (!is_id(spec) || value == std::floor(value)) return absl::OkStatus();
  return refused(name, " = ", value, " must be a whole number, the id of a ", spec.unit);
}

absl::Status check_programs(const BodyProperties& properties, std::span<const ProgramRecord> records,
                            const ProgramModules& modules) {
  if (records.empty()) return absl::OkStatus();
  if (records.size() > kProgramsPerBodyMax)
    return refused("the body's ", records.size(), " programs must be at most ", kProgramsPerBodyMax);
  if (properties.motion == Motion::kStatic)
    return refused("a body with a program must be dynamic or kinematic, not static");
  for (const ProgramRecord& record : records) {
    if (absl::Status status = check_program(record, modules); !status.ok()) return status;
  }
  return absl::OkStatus();
}

void move_ids(ProgramRecord& record, std::uint64_t bodies, std::uint64_t joints) {
  const std::span<const NumberSpec> table = find_program(record.kind)->parameters();
  for (std::size_t n = 0; n < record.parameters.size(); ++n) {
    if (!is_id(table[n]) || record.parameters[n] == 0) continue;
    record.parameters[n] += static_cast<double>(table[n].unit == kBodyUnit ? bodies : joints);
  }
}

absl::Status check_programs(const WorldDescription& world) {
  for (const BodyDescription& body : world.bodies) {
    const std::string title = absl::StrCat("body \"", body.name, "\"");
    if (absl::Status status = check_programs(body.properties, body.programs, world.settings.modules);
        !status.ok())
      return in(title, status);
    for (const ProgramRecord& record : body.programs) {
      const Program& program = *find_program(record.kind);
      if (absl::Status status = program.check(body.properties); !status.ok())
        return in(absl::StrCat(title, ": program ", record.kind), status);
      const std::span<const NumberSpec> table = program.parameters();
      for (std::size_t n = 0; n < record.parameters.size(); ++n) {
        if (!is_id(table[n])) continue;
        const std::size_t most = table[n].unit == kBodyUnit ? world.bodies.size() : world.joints.size();
        if (record.parameters[n] > static_cast<double>(most))
          return in(title,
                    refused(title_of(record, table[n].name), " = ", record.parameters[n], " must be at most ",
                            most, ", the number of ", table[n].unit == kBodyUnit ? "bodies" : "joints"));
      }
    }
  }
  return absl::OkStatus();
}

absl::Status check_numbers(const Program& program, const TellProgram& told) {
  const auto check = [&](std::span<const std::pair<std::uint32_t, double>> numbers,
                         std::span<const NumberSpec> table, absl::string_view what) -> absl::Status {
    for (const auto& [place, value] : numbers) {
      if (place >= table.size())
        return refused("program ", program.kind(), ": it has no ", what, " ", place, "; it has ",
                       table.size());
      const NumberSpec& spec = table[place];
      if (absl::Status status = check_number(spec, value); !status.ok())
        return in(absl::StrCat("program ", program.kind()), status);
    }
    return absl::OkStatus();
  };
  if (absl::Status status = check(told.inputs, program.inputs(), "input"); !status.ok()) return status;
  return check(told.parameters, program.parameters(), "parameter");
}

}  // namespace tessera
