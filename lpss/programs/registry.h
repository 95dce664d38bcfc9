// Programs by their kinds, and checks of instances.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <span>
#include <string>

#include "lpss/model/body.h"
#include "lpss/model/command.h"
#include "lpss/model/world_description.h"
#include "lpss/programs/program.h"

namespace tessera {

// Those that are built in, ascending by kind; they live as long as the process.
std::span<const Program* const> programs();

// One that is built in, or that of a module of a world of this process, which lives as long as that: also by
// the name of a module that no other has. Null if there is none of this kind.
const Program* find_program(absl::string_view kind);

// The place of a number in a table; nothing where it has none of this name.
std::optional<std::uint32_t> place_of(absl::string_view name, std::span<const NumberSpec> table);

// A parameter or an input by its name; null where the program has none.
const NumberSpec* find_spec(const Program& program, absl::string_view name);

// "program mover has no number 'spead'; it has: x, y, ...": its parameters and inputs.
std::string no_number(const Program& program, absl::string_view name);

// An instance with the first values of all numbers. NOT_FOUND, with the kinds that there are.
absl::StatusOr<ProgramRecord> new_program(absl::string_view kind);

// Sets a parameter or an input by its name, whatever its bounds are: INVALID_ARGUMENT, with those that there
// are.
absl::Status set_number(ProgramRecord& record, absl::string_view name, double value);

// Gives an instance all numbers that its program has with its parameters: one of an earlier version has
// fewer.
void complete(ProgramRecord& record);

// Whether a number is the id of a body or joint.
inline bool is_id(const NumberSpec& spec) { return spec.unit == kBodyUnit || spec.unit == kJointUnit; }

// Whether a parameter or input may have this value: INVALID_ARGUMENT, with the bound.
absl::Status check_number(const NumberSpec& spec, double value);

// Whether a body of a world with these modules may have these, also one that they cannot work on any more,
// which stops them: INVALID_ARGUMENT, naming the program and the number with its bound.
absl::Status check_programs(const BodyProperties& properties, std::span<const ProgramRecord> records,
                            const ProgramModules& modules);

// Its parameters that are bodies or joints, which are places in a list plus one, become ids that are higher
// by so much.
void move_ids(ProgramRecord& record, std::uint64_t bodies, std::uint64_t joints);

// Those that bodies of a world begin with, in which numbers that are bodies or joints are places plus one:
// likewise, naming the body.
absl::Status check_programs(const WorldDescription& world);

// Whether a program can be told this: INVALID_ARGUMENT, naming the number and its bound.
absl::Status check_numbers(const Program& program, const TellProgram& told);

}  // namespace tessera
