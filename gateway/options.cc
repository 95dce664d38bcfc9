#include "gateway/options.h"

#include <CLI/CLI.hpp>

#include "daemon/options.h"

namespace tessera {
namespace {

constexpr std::size_t kCallsOfAnyoneMax = 1'000'000;

}  // namespace

void add_options(CLI::App& app, GatewayArguments& arguments) {
  app.footer("Example: tessera-gateway --connect 127.0.0.1:7300 --listen 127.0.0.1:7310");
  app.add_option("--listen", arguments.listen, "Address for clients, host:port; port 0: any free port")
      ->capture_default_str();
  app.add_option("--connect", arguments.connect,
                 "host:port of the coordinator; of several, all of them, separated by commas")
      ->delimiter(',')
      ->default_str(arguments.connect.front());
  app.add_option("--calls", arguments.limits.calls,
                 "Calls and streams under way at a time; further ones are refused")
      ->check(CLI::Range(std::size_t{1}, kCallsOfAnyoneMax))
      ->capture_default_str();
  app.add_option("--calls-per-client", arguments.limits.calls_per_client,
                 "Likewise, of one address that clients come from")
      ->check(CLI::Range(std::size_t{1}, kCallsOfAnyoneMax))
      ->capture_default_str();
  add_metrics_option(app, arguments.metrics_address);
  app.add_option("--ready-file", arguments.ready_file,
                 "Write the address for clients to this file once it accepts connections")
      ->configurable(false);
  add_parent_option(app, arguments.exit_with_parent);
  add_shared_options(app, arguments.dds, arguments.log, arguments.keys);
}

std::optional<int> read_arguments(int argc, char** argv, GatewayArguments& arguments) {
  CLI::App app(
      "The one address of a cluster: passes on calls and streams, so that clients need reach no other "
      "daemon.",
      kGatewayName);
  add_options(app, arguments);
  return parse_arguments(app, argc, argv);
}

}  // namespace tessera
