#include "daemon/parse_command_line.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/string_view.h>

#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "lpss/base/nearest_word.h"

namespace tessera {
namespace {

// The last command that was named.
const CLI::App& named_last(const CLI::App& app) {
  const std::vector<CLI::App*> named = app.get_subcommands();
  return named.empty() ? app : named_last(*named.back());
}

std::vector<std::string> commands_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* one : command.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(one->get_name());
  }
  std::sort(names.begin(), names.end());
  return names;
}

// Without dashes.
std::vector<std::string> options_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    std::ranges::copy(option->get_lnames(), std::back_inserter(names));
  return names;
}

bool is_option(absl::string_view argument) { return absl::StartsWith(argument, "-"); }

// The argument, with what it may have been meant to be.
std::string with_guess(const CLI::App& command, const std::string& argument) {
  const std::vector<std::string> names = is_option(argument) ? options_of(command) : commands_of(command);
  const std::vector<absl::string_view> known(names.begin(), names.end());
  const absl::string_view word =
      absl::string_view(argument).substr(std::min(argument.find_first_not_of('-'), argument.size()));
  const absl::string_view guess = nearest_word(word.substr(0, word.find('=')), known);
  if (guess.empty()) return argument;
  return absl::StrCat(argument, " (did you mean ", is_option(argument) ? "--" : "", guess, "?)");
}

// Of arguments that nobody knows, the options: what else is left over may be the value of one of them.
CLI::ExtrasError unknown_arguments(const CLI::App& command, const std::vector<std::string>& unknown) {
  std::vector<std::string> named;
  std::ranges::copy_if(unknown, std::back_inserter(named), is_option);
  if (named.empty()) named = unknown;
  for (std::string& argument : named) argument = with_guess(command, argument);
  std::ranges::reverse(named);  // as CLI11 reads them
  return CLI::ExtrasError(std::move(named));
}

// "tessera keys create"
std::string full_name(const CLI::App& command) {
  const CLI::App* const parent = command.get_parent();
  return parent == nullptr ? command.get_name() : absl::StrCat(full_name(*parent), " ", command.get_name());
}

// A longer list is left to the help.
constexpr std::size_t kOptionsListedMax = 24;

// What a command takes: "Usage: tessera load [OPTIONS] world", and the names of its options.
std::string usage_of(const CLI::App& command) {
  const CLI::Formatter formatter;
  std::string required;
  std::string places;
  std::vector<std::string> others;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) {
      absl::StrAppend(&places, " ", formatter.make_option_usage(option));
    } else if (option->get_required()) {
      absl::StrAppend(&required, " ", option->get_name(), " ", option->get_type_name());
    } else if (option != command.get_help_ptr() && !option->get_group().empty()) {  // which hides it
      others.push_back(option->get_name());
    }
  }
  if (!commands_of(command).empty()) absl::StrAppend(&places, " COMMAND");
  std::string usage =
      absl::StrCat("Usage: ", full_name(command), required, others.empty() ? "" : " [OPTIONS]", places, "\n");
  if (!others.empty() && others.size() <= kOptionsListedMax)
    absl::StrAppend(&usage, "Options: ", absl::StrJoin(others, ", "), "\n");
  return usage;
}

// Whether too much has been given, or too little.
bool is_of_usage(const CLI::Error& error) {
  const auto is = [&](CLI::ExitCodes code) { return error.get_exit_code() == static_cast<int>(code); };
  return is(CLI::ExitCodes::ExtrasError) || is(CLI::ExitCodes::RequiredError) ||
         is(CLI::ExitCodes::ArgumentMismatch);
}

std::string failure_message(const CLI::App* app, const CLI::Error& error) {
  const CLI::App& command = named_last(*app);
  return absl::StrCat(error.what(), "\n", is_of_usage(error) ? usage_of(command) : "", "Run ",
                      full_name(command), " --help for more information.\n");
}

}  // namespace

CLI::Validator number_within(double low, double high) {
  const CLI::Range range(low, high);
  const auto error_of = [range](std::string& text) {
    double value = 0;
    const bool is_nan = CLI::detail::lexical_cast(text, value) && std::isnan(value);
    return is_nan ? absl::StrCat("Value ", text, " is not a number") : range(text);
  };
  return CLI::Validator(error_of, range.get_description());
}

void parse_command_line(CLI::App& app, int argc, char** argv) {
  app.failure_message(failure_message);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    throw unknown_arguments(named_last(app), app.remaining(/*recurse=*/true));
  } catch (const CLI::RequiredError& missing) {
    const CLI::App& command = named_last(app);
    const std::vector<std::string> unknown = app.remaining(/*recurse=*/true);
    std::string message = unknown.empty() ? missing.what() : unknown_arguments(command, unknown).what();
    if (const std::vector<std::string> commands = commands_of(command); !commands.empty()) {
      absl::StrAppend(&message, "\nThere are: ", absl::StrJoin(commands, ", "));
    }
    throw CLI::ParseError(message, missing.get_exit_code());
  }
}

}  // namespace tessera
