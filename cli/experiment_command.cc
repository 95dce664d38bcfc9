// `tessera experiment`: the program beside this one that measures what Tessera claims.
#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include "cli/child_process.h"
#include "cli/command.h"

namespace tessera::cli {
namespace {

constexpr const char* kProgram = "tessera-experiments";

// This process becomes that program, so that signals and its exit code are the user's. Returns where it
// cannot.
absl::Status become_experiments(std::vector<std::string> arguments) {
  const std::filesystem::path folder = executable_folder();
  std::string program = folder / kProgram;
  std::vector<char*> words = {program.data()};
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  execv(program.c_str(), words.data());
  if (errno != ENOENT) return absl::UnavailableError(absl::StrCat(program, ": ", std::strerror(errno)));
  return absl::NotFoundError(absl::StrCat("there is no program ", program,
                                          "; in a clone, deploy/build.sh release ", kProgram, " builds it"));
}

}  // namespace

void add_experiment_command(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand("experiment", "Run the measurements behind what Tessera claims.");
  command.prefix_command();  // all arguments, --help too, are for the program
  command.set_help_flag();
  command.callback([&command, &action] {
    action = [arguments = command.remaining()] { return become_experiments(arguments); };
  });
}

}  // namespace tessera::cli
