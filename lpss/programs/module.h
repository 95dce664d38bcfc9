// Programs that users write, as WebAssembly modules of their worlds (docs/programs.md).
//
// A module is known to the process while somebody has it: its kind is then found as those that are built in
// are (registry.h).
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "lpss/model/program.h"
#include "lpss/programs/program.h"

namespace tessera {

// Reads and checks a module. INVALID_ARGUMENT, naming the byte or the line of its description.
absl::StatusOr<std::shared_ptr<const ProgramModule>> load_module(std::string bytes);
// Likewise, naming the file; NOT_FOUND where it cannot be read.
absl::StatusOr<std::shared_ptr<const ProgramModule>> load_module_file(const std::filesystem::path& file);

// Whether this process can run them: NOT_FOUND where it has no engine, INTERNAL where the engine does not
// take one.
absl::Status can_run(const ProgramModules& modules);

// By its kind; or by its name, where one alone has it. Null where there is none.
std::shared_ptr<const Program> find_module(absl::string_view kind);

// Whether it has questions: it exports ask().
bool asks(const ProgramModule& module);

// What its last call on this thread has spent.
std::int64_t instructions_of(const ProgramModule& module);

}  // namespace tessera
