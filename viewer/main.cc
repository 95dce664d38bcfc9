// tessera-viewer: a client of a cluster that shows its world in a browser.
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "tessera/client.h"
#include "viewer/web_server.h"

namespace tessera::viewer {
namespace {

struct Arguments {
  std::string connect = "127.0.0.1:7300";
  std::string listen = "127.0.0.1:7380";
  std::string ready_file;
  std::string log_level = "info";
  PageOptions page;
  bool any_port = false;
  bool exit_with_parent = false;
};

// The exit code of a process that must end now, or -1.
int parse(int argc, char** argv, Arguments& arguments) {
  CLI::App app("Shows the world of a cluster in a browser.", "tessera-viewer");
  app.footer("Example: tessera-viewer --connect 127.0.0.1:7300 --listen 127.0.0.1:7380 --read-only");
  app.add_option("--connect", arguments.connect, "host:port of the coordinator")
      ->envname("TESSERA_ADDRESS")
      ->capture_default_str();
  app.add_option("--listen", arguments.listen, "Address for browsers, host:port; port 0: any free one")
      ->capture_default_str();
  app.add_flag("--any-port", arguments.any_port, "Take any free port where the one of --listen is in use");
  app.add_flag("--read-only", arguments.page.read_only, "Refuse what would change the world");
  app.add_option("--fps", arguments.page.frames_per_second, "Frames per second to a page, at most")
      ->check(CLI::Range(1.0, 120.0))
      ->capture_default_str();
  app.add_option("--ready-file", arguments.ready_file,
                 "Write the address of the page here once it is served");
  app.add_option("--log-level", arguments.log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--exit-with-parent", arguments.exit_with_parent,
               "End when the process that started this one does");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return -1;
}

absl::StatusOr<std::unique_ptr<WebServer>> open(const Arguments& arguments, Client& client) {
  absl::StatusOr<std::unique_ptr<WebServer>> server =
      WebServer::open(arguments.listen, client, arguments.page);
  if (server.ok() || !arguments.any_port) return server;
  const std::string host = arguments.listen.substr(0, arguments.listen.rfind(':'));
  return WebServer::open(host + ":0", client, arguments.page);
}

// Readers never see half of it.
bool write_ready_file(const std::string& path, const std::string& url) {
  const std::string draft = path + ".new";
  {
    std::ofstream file(draft, std::ios::trunc);
    file << url << '\n';
    if (!file.flush()) return false;
  }
  return std::rename(draft.c_str(), path.c_str()) == 0;
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
    return 1;
  }
  const absl::StatusOr<std::unique_ptr<WebServer>> server = open(arguments, **client);
  if (!server.ok()) {
    spdlog::error("{}", std::string(server.status().message()));
    return 1;
  }
  if (!arguments.ready_file.empty() && !write_ready_file(arguments.ready_file, (*server)->url())) {
    spdlog::error("cannot write {}", arguments.ready_file);
    return 1;
  }
  std::printf("the page is on %s\n", (*server)->url().c_str());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&ends, &signal);
  return 0;
}

}  // namespace
}  // namespace tessera::viewer

int main(int argc, char** argv) {
  tessera::viewer::Arguments arguments;
  const pid_t parent = getppid();
  if (const int code = tessera::viewer::parse(argc, argv, arguments); code >= 0) return code;
  if (arguments.exit_with_parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) return 1;  // it ended before we asked
  }
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // its failures are ours to tell
  signal(SIGPIPE, SIG_IGN);                           // a page that has gone is no reason to end
  spdlog::set_level(spdlog::level::from_str(arguments.log_level));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ viewer: %v");
  return tessera::viewer::run(arguments);
}
