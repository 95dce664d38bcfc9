// tessera-ros: a client of a cluster that publishes its time and its bodies for ROS 2.
#include <signal.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "client_sdk/cli/command.h"
#include "client_sdk/cli/text.h"
#include "daemon/log.h"
#include "ros/feed.h"
#include "ros/publisher.h"
#include "tessera/client.h"

namespace tessera::ros {
namespace {

constexpr double kReachMax = 1e9;  // m

struct Arguments {
  std::string connect = "127.0.0.1:7300";
  std::uint32_t domain = 0;
  FeedOptions feed;
  LogOptions log;
};

// The exit code of a process that must end now, or -1.
int parse(int argc, char** argv, Arguments& arguments) {
  CLI::App app("Publishes the time and the bodies of a cluster as /clock, /tf and /tf_static of ROS 2.",
               "tessera-ros");
  app.footer("Example: tessera-ros --connect 127.0.0.1:7300 --sector 2^62,0,0 --reach 50");
  FeedOptions& feed = arguments.feed;
  app.add_option("--connect", arguments.connect, "host:port of the coordinator")
      ->envname("TESSERA_ADDRESS")
      ->capture_default_str();
  app.add_option("--domain", arguments.domain, "Domain id of ROS, 0 to 232")
      ->envname("ROS_DOMAIN_ID")
      ->check(CLI::Range(0u, 232u))
      ->capture_default_str();
  app.add_option("--frame", feed.frame, "Name of the frame that all others are children of")
      ->capture_default_str();
  cli::add_parsed(app, "--sector", feed.sector, cli::parse_sector,
                  "I,J,K: the sector whose centre that frame is; that of the world's origin if not given");
  CLI::Option* reach =
      app.add_option("--reach", feed.reach, "m; bodies within this of that centre along each axis")
          ->check(CLI::Range(0.0, kReachMax))
          ->capture_default_str();
  app.add_option("--bodies", feed.bodies, "NAME,NAME,...: these bodies instead, wherever they are")
      ->delimiter(',')
      ->excludes(reach);
  app.add_option("--rate", feed.rate, "Publications per second of wall time, at most")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  app.add_option("--log-level", arguments.log.level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? cli::kSuccess : cli::kUsage;
  }
  return -1;
}

int run(const Arguments& arguments) {
  // Blocked before any thread is made, so that only the wait below takes them.
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  const absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(arguments.connect);
  if (!client.ok()) {
    spdlog::error("{}", std::string(client.status().message()));
    return cli::kFailure;
  }
  const absl::StatusOr<std::unique_ptr<Publisher>> publisher = Publisher::open(arguments.domain);
  if (!publisher.ok()) {
    spdlog::error("{}", std::string(publisher.status().message()));
    return cli::kFailure;
  }
  const Feed feed(**client, **publisher, arguments.feed);
  std::printf("/clock, /tf and /tf_static are in domain %u of ROS\n", arguments.domain);
  std::fflush(stdout);
  int signal = 0;
  sigwait(&ends, &signal);
  return cli::kSuccess;
}

}  // namespace
}  // namespace tessera::ros

int main(int argc, char** argv) {
  tessera::ros::Arguments arguments;
  if (const int code = tessera::ros::parse(argc, argv, arguments); code >= 0) return code;
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // its failures are ours to tell
  tessera::start_log("ros", arguments.log);
  return tessera::ros::run(arguments);
}
