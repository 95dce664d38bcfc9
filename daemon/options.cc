#include "daemon/options.h"

#include <CLI/CLI.hpp>
#include <utility>

#include "daemon/configuration.h"
#include "daemon/parse_command_line.h"

namespace tessera {

void add_version_flag(CLI::App& app) {
  app.set_version_flag("--version", app.get_name() + " " + TESSERA_VERSION, "Print the version and exit");
}

void add_log_options(CLI::App& app, LogOptions& log) {
  app.add_option("--log-level", log.level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->group(kSharedOptions)
      ->capture_default_str();
  app.add_option("--log-format", log.format, "text, or json: one object per line")
      ->check(CLI::IsMember({"text", "json"}))
      ->group(kSharedOptions)
      ->capture_default_str();
}

void add_keys_options(CLI::App& app, KeysOptions& keys) {
  app.add_option("--keys", keys.folder,
                 "Folder of `tessera keys create`: clients must show a certificate or a token of it")
      ->group(kSharedOptions)
      ->capture_default_str();
  app.add_flag(
         "--insecure", keys.insecure,
         "Without keys, listen beyond loopback nevertheless: whoever reaches the address controls the world")
      ->group(kSharedOptions)
      ->default_str("false");
}

void add_shared_options(CLI::App& app, DdsOptions& dds, LogOptions& log, KeysOptions& keys) {
  app.add_option("--cluster", dds.cluster, "Name of the cluster")
      ->group(kSharedOptions)
      ->capture_default_str();
  app.add_option("--domain", dds.domain, "DDS domain, 0 to 232")
      ->check(CLI::Range(0u, 232u))
      ->group(kSharedOptions)
      ->capture_default_str();
  app.add_option("--interface", dds.network.interface, "Network interface for traffic between daemons")
      ->group(kSharedOptions)
      ->capture_default_str();
  app.add_option("--peers", dds.network.peers,
                 "Hosts of the cluster: addresses or names; names without an address are skipped")
      ->delimiter(',')
      ->group(kSharedOptions)
      ->default_str("127.0.0.1");
  app.add_option("--shared-memory", dds.network.shared_memory,
                 "Small messages between daemons of one host and user go through memory that they share")
      ->group(kSharedOptions)
      ->default_str("true");
  add_keys_options(app, keys);
  add_log_options(app, log);
}

void add_metrics_option(CLI::App& app, std::string& metrics_address) {
  app.add_option("--metrics-address", metrics_address,
                 "Serve /metrics, /healthz and /readyz at this host:port; port 0: any free port; empty: off")
      ->capture_default_str();
}

void add_seconds(CLI::App& app, const std::string& name, std::chrono::nanoseconds& value,
                 const std::string& help, double low, double high) {
  app.add_option_function<double>(
         name,
         [&value](double seconds) {
           value =
               std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
         },
         help)
      ->check(number_within(low, high))
      ->default_str(CLI::detail::to_string(std::chrono::duration<double>(value).count()));
}

void add_mebibytes(CLI::App& app, const std::string& name, std::size_t& bytes, const std::string& help) {
  constexpr int kBits = 20;
  constexpr std::size_t kMost = std::size_t{1} << 20;
  app.add_option_function<std::size_t>(
         name, [&bytes](std::size_t mebibytes) { bytes = mebibytes << kBits; }, help)
      ->check(CLI::Range(std::size_t{1}, kMost))
      ->default_str(CLI::detail::to_string(bytes >> kBits));
}

void add_labels(CLI::App& app, const std::string& name, Labels& labels, const std::string& help) {
  app.add_option_function<Labels>(
         name,
         [&labels, name](Labels given) {
           if (given == Labels{""}) given.clear();  // as a configuration file says that there are none
           if (absl::Status status = check_labels(given); !status.ok())
             throw CLI::ValidationError(name, std::string(status.message()));
           labels = std::move(given);
         },
         help)
      ->delimiter(',')
      ->default_str("");
}

void add_parent_option(CLI::App& app, bool& exit_with_parent) {
  app.add_flag("--exit-with-parent", exit_with_parent, "Exit when the process that started this one exits")
      ->configurable(false);
}

std::optional<int> parse_arguments(CLI::App& app, int argc, char** argv) {
  add_version_flag(app);
  read_configuration(app);
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

}  // namespace tessera
