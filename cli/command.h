// How subcommands are made: each group adds its own to the application and leaves the work of the chosen one.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "client_sdk/arguments/parsed_option.h"

namespace tessera::cli {

// What the chosen subcommand does once all options are known.
using Action = std::function<absl::Status()>;

void add_run_command(CLI::App& app, Action& action);
void add_cluster_commands(CLI::App& app, Action& action);
void add_apply_command(CLI::App& app, Action& action);
void add_body_commands(CLI::App& app, Action& action);
void add_convert_command(CLI::App& app, Action& action);
void add_joint_commands(CLI::App& app, Action& action);
void add_program_check(CLI::App& app, Action& action);
void add_program_commands(CLI::App& app, Action& action);
void add_keys_commands(CLI::App& app, Action& action);
void add_query_commands(CLI::App& app, Action& action);
void add_replay_command(CLI::App& app, Action& action);
void add_tune_command(CLI::App& app, Action& action);
void add_snapshot_commands(CLI::App& app, Action& action);
void add_status_commands(CLI::App& app, Action& action);
void add_store_commands(CLI::App& app, Action& action);
void add_simulate_command(CLI::App& app, Action& action);
void add_experiment_command(CLI::App& app, Action& action);

// A subcommand with an example at the end of its help.
inline CLI::App& add_command(CLI::App& app, const std::string& name, const std::string& help,
                             const std::string& example) {
  CLI::App& command = *app.add_subcommand(name, help);
  command.footer(absl::StrCat("Example:\n  ", example));
  return command;
}

// CLI::PositiveNumber prints its range, of 300 digits.
inline CLI::Validator above_zero() {
  return CLI::Validator(
      [](const std::string& text) {
        double number = 0;
        const bool positive = absl::SimpleAtod(text, &number) && number > 0;
        return positive ? std::string() : absl::StrCat("'", text, "' must be a number above 0");
      },
      "ABOVE 0");
}

}  // namespace tessera::cli
