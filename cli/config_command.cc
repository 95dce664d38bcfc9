// config show: what the daemons would run with.
#include "cli/config_command.h"

#include <absl/strings/str_format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "coordinator/options.h"
#include "daemon/configuration.h"
#include "gateway/options.h"
#include "sector_server/options.h"

namespace tessera::cli {
namespace {

// As the daemon itself would read `arguments`, and the environment.
absl::Status read(CLI::App& daemon, std::vector<std::string> arguments) {
  read_configuration(daemon);
  try {
    daemon.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(absl::StrCat(daemon.get_name(), ": ", error.what()));
  }
  return absl::OkStatus();
}

absl::Status show(const std::filesystem::path& file) {
  // CLI11 takes arguments from the end.
  std::vector<std::string> arguments;
  if (!file.empty()) arguments = {file.string(), "--config"};
  CLI::App coordinator("", kCoordinatorName);
  CoordinatorArguments coordinator_arguments;
  add_options(coordinator, coordinator_arguments);
  CLI::App sector_server("", kSectorServerName);
  SectorServerArguments server_arguments;
  add_options(sector_server, server_arguments);
  CLI::App gateway("", kGatewayName);
  GatewayArguments gateway_arguments;
  add_options(gateway, gateway_arguments);
  for (CLI::App* daemon : {&coordinator, &sector_server, &gateway}) {
    if (absl::Status status = read(*daemon, arguments); !status.ok()) return status;
  }
  absl::PrintF("%s", configuration_text({&coordinator, &sector_server, &gateway}));
  return absl::OkStatus();
}

}  // namespace

void add_config_command(CLI::App& app, Action& action) {
  CLI::App& config = add_command(app, "config", "Check and print the configuration of the daemons.",
                                 "tessera config show --config tessera.toml");
  config.require_subcommand(1);
  CLI::App& command = add_command(
      config, "show", "Check a configuration file, and print it with every key explained and all defaults.",
      "tessera config show --config /etc/tessera/tessera.toml");
  const auto file = std::make_shared<std::filesystem::path>();
  command.add_option("--config", *file, "configuration file; without: the environment and the defaults");
  command.callback([file, &action] { action = [file] { return show(*file); }; });
}

}  // namespace tessera::cli
