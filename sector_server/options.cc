#include "sector_server/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <thread>

#include "daemon/options.h"
#include "daemon/parse_command_line.h"
#include "proto/server_traits.h"

namespace tessera {

void add_options(CLI::App& app, SectorServerArguments& arguments) {
  SectorServerOptions& server = arguments.server;
  app.footer("Example: tessera-sector-server --cluster lab --engine f32 --threads 4");
  app.add_option_function<std::string>(
         "--engine",
         [&server](const std::string& name) {
           server.precision = name == "f64" ? Precision::kFloat64 : Precision::kFloat32;
         },
         "Precision of the engine, f32 or f64")
      ->check(CLI::IsMember({"f32", "f64"}))
      ->default_str("f32");
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  server.threads = cores;
  app.add_option_function<int>(
         "--threads", [&server, cores](int threads) { server.threads = threads == 0 ? cores : threads; },
         "Threads that step sectors; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->default_str("0");
  app.add_option(
         "--capacity", server.capacity,
         "How much of a world this server takes, by comparison with others; 0: as much as its threads")
      ->check(number_within(0, kCapacityMax))
      ->capture_default_str();
  add_labels(
      app, "--labels", server.labels,
      "Where this server is, or what it has, from the largest to the smallest, such as zone=eu,rack=a7");
  app.add_option("--listen", arguments.listen,
                 "Address at which clients open streams, host:port; port 0: any free port")
      ->capture_default_str();
  add_seconds(app, "--join-timeout", server.join_timeout, "How long to wait for a coordinator, s", 0.1, 1e6);
  add_seconds(app, "--coordinator-timeout", server.coordinator_timeout,
              "Silence after which the coordinator counts as lost, s", 0.1, 1e6);
  app.add_option_function<std::uint64_t>(
         "--ground-memory",
         [&arguments](std::uint64_t megabytes) { arguments.ground.bytes_max = megabytes << 20; },
         "Tiles of ground that are kept beside those in use, MiB")
      ->check(CLI::Range(1, 1 << 20))
      ->default_str("256");
  app.add_option("--ground-threads", arguments.ground.threads,
                 "Threads that have tiles of ground ready before they are needed; 0: none")
      ->check(CLI::Range(0, 64))
      ->capture_default_str();
  add_metrics_option(app, arguments.metrics_address);
  add_parent_option(app, arguments.exit_with_parent);
  add_shared_options(app, arguments.dds, arguments.log, arguments.keys);
}

std::optional<int> read_arguments(int argc, char** argv, SectorServerArguments& arguments) {
  CLI::App app("Hosts sectors of a world, and steps them when the coordinator grants ticks.",
               kSectorServerName);
  add_options(app, arguments);
  return parse_arguments(app, argc, argv);
}

}  // namespace tessera
