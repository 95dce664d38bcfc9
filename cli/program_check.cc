// program check: whether a module would be taken, and what it says of its program.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/text.h"
#include "lpss/model/program.h"
#include "lpss/model/settings.h"
#include "lpss/programs/module.h"
#include "lpss/programs/registry.h"

namespace tessera::cli {
namespace {

void print(const char* what, std::span<const NumberSpec> table, bool has_bounds) {
  for (const NumberSpec& number : table) {
    absl::PrintF("  %s %s = %g %s", what, number.name, number.first, number.unit);
    if (has_bounds) absl::PrintF(" (%g to %g)", number.least, number.most);
    absl::PrintF("  %s\n", number.meaning);
  }
}

// One call of ask() and of run(), at tick 1, on a body of 1 kg at rest, with nothing around it.
absl::Status try_once(const ProgramModule& module) {
  const Program& program = *find_program(module.kind);
  absl::StatusOr<ProgramRecord> record = new_program(module.kind);
  if (!record.ok()) return record.status();
  BodyProperties properties;
  properties.motion = program.motion().value_or(Motion::kDynamic);
  properties.mass = 1;
  const BodyState state;
  const Senses senses{.tick = 1,
                      .dt = 1.0 / 60,
                      .body = BodyId{1},
                      .sector = {},
                      .properties = properties,
                      .state = state,
                      .gravity = Eigen::Vector3d(0, 0, -9.81),
                      .start = Eigen::Vector3d::Zero(),
                      .parameters = record->parameters,
                      .inputs = record->inputs,
                      .findings = {}};
  std::vector<Command> commands;
  std::uint64_t wake_at = 0;
  std::string fault;
  if (asks(module)) {
    std::vector<ProgramAsk> questions;
    Asker asker(senses, questions, fault);
    program.ask(senses, record->values, asker);
    if (!fault.empty()) return absl::InvalidArgumentError(absl::StrCat("ask() is stopped: ", fault));
    absl::PrintF("ask(): %s instructions, %d questions\n", grouped(instructions_of(module)),
                 questions.size());
  }
  Actor actor(senses, WorldSettings().sector_size, commands, wake_at, fault);
  program.run(senses, record->values, actor);
  if (!fault.empty()) return absl::InvalidArgumentError(absl::StrCat("run() is stopped: ", fault));
  absl::PrintF("run(): %s instructions, %d acts\n", grouped(instructions_of(module)), commands.size());
  return absl::OkStatus();
}

absl::Status check(const std::filesystem::path& file) {
  const absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module_file(file);
  if (!module.ok()) return module.status();
  if (absl::Status status = can_run({*module}); !status.ok()) return status;
  const Program& program = *find_program((*module)->kind);
  absl::PrintF("%s, %s bytes: %s\n", program.kind(), grouped((*module)->bytes.size()), program.summary());
  if (program.motion()) absl::PrintF("  for bodies that are %s\n", name_of(*program.motion()));
  print("parameter", program.parameters(), true);
  print("input", program.inputs(), true);
  print("value", program.values(), false);
  return try_once(**module);
}

}  // namespace

void add_program_check(CLI::App& app, Action& action) {
  CLI::App& program = add_command(app, "program", "Check programs in WebAssembly.",
                                  "tessera program check worlds/programs/flee.wasm");
  program.require_subcommand(1);
  CLI::App& command = add_command(
      program, "check", "Check a module, list the numbers of its program, and call its functions once.",
      "tessera program check worlds/programs/flee.wasm");
  const auto file = std::make_shared<std::filesystem::path>();
  command.add_option("file", *file, "a WebAssembly module")->required();
  command.callback([file, &action] { action = [file] { return check(*file); }; });
}

}  // namespace tessera::cli
