// tessera-viewer: a client of a cluster that shows its world in a browser.
#include <absl/strings/str_cat.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "client_sdk/live/client_program.h"
#include "daemon/address.h"
#include "daemon/locks.h"
#include "daemon/open_files.h"
#include "daemon/options.h"
#include "daemon/parent_process.h"
#include "daemon/parse_command_line.h"
#include "daemon/ready_file.h"
#include "keys/keys_folder.h"
#include "viewer/web_server.h"

namespace tessera::viewer {
namespace {

struct Arguments {
  live::ClientOptions client;
  std::string listen = "127.0.0.1:7380";
  std::vector<std::string> hosts;
  std::string ready_file;
  std::filesystem::path looks;
  std::filesystem::path worlds;
  std::filesystem::path snapshots = snapshots_of_user();
  std::filesystem::path recordings = recordings_of_user();
  std::string recorder = RecorderOptions().command;
  double recordings_max = 2000;  // MB
  PageOptions page;
  KeysOptions keys;
  bool any_port = false;
  bool exit_with_parent = false;
};

std::string complaint_of_address(const std::string& address) {
  return parse_listen_address(address) ? "" : absl::StrCat(address, " is not host:port");
}

void add_options(CLI::App& app, Arguments& arguments) {
  live::add_client_options(app, arguments.client);
  app.add_option("--listen", arguments.listen, "Address for browsers, host:port; port 0: any free port")
      ->check(complaint_of_address)
      ->capture_default_str();
  app.add_option(
      "--allow-host", arguments.hosts,
      "A name under which browsers may ask, besides IP addresses, localhost and this machine's name");
  app.add_flag("--any-port", arguments.any_port, "Use any free port if that of --listen is in use");
  app.add_flag("--read-only", arguments.page.read_only, "Refuse requests that would change the world");
  app.add_flag(
      "--insecure", arguments.keys.insecure,
      "Without keys, listen beyond loopback nevertheless: whoever reaches the address controls the world");
  app.add_option("--fps", arguments.page.frames_per_second,
                 "Maximum number of frames per second for each browser")
      ->check(number_within(1.0, 120.0))
      ->capture_default_str();
  app.add_option("--looks", arguments.looks,
                 "World file whose visuals show what bodies look like, while a world of its name is loaded");
  app.add_option("--worlds", arguments.worlds,
                 "Folder of world files that it offers to load; by default those of the installation");
  app.add_option(
      "--snapshots", arguments.snapshots,
      "Folder in which it keeps snapshots; empty: none. By default tessera/snapshots among the states "
      "of this user's programs");
  app.add_option("--recordings", arguments.recordings,
                 "Folder in which it keeps recordings; empty: none. By default tessera/recordings among the "
                 "states of this user's programs");
  app.add_option("--recordings-max", arguments.recordings_max,
                 "MB that all recordings in it together may have; what is recorded then ends")
      ->check(number_within(1, 1e9))
      ->capture_default_str();
  app.add_option("--recorder", arguments.recorder,
                 "The program tessera-record, if it is neither beside this one nor in PATH")
      ->capture_default_str();
  app.add_option("--ready-file", arguments.ready_file,
                 "Write the address of the web UI to this file once it is served");
  add_parent_option(app, arguments.exit_with_parent);
}

std::shared_ptr<const WorldShelf> shelf_of(const Arguments& arguments) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return std::make_shared<WorldShelf>(
      arguments.worlds.empty() ? worlds_of_installation(program.parent_path()) : arguments.worlds,
      arguments.snapshots);
}

std::shared_ptr<Recorder> recorder_of(const Arguments& arguments) {
  constexpr double kMegabyte = 1e6;
  RecorderOptions options;
  options.command = arguments.recorder;
  options.folder = arguments.recordings;
  options.bytes_max = static_cast<std::uint64_t>(arguments.recordings_max * kMegabyte);
  options.address = arguments.client.connect;
  options.keys = arguments.client.keys;
  return std::make_shared<Recorder>(std::move(options));
}

absl::StatusOr<std::unique_ptr<WebServer>> open(const Arguments& arguments, Client& client) {
  const absl::StatusOr<std::optional<ServerKeys>> keys =
      open_locks({.folder = arguments.client.keys, .insecure = arguments.keys.insecure}, kViewerFolder,
                 {arguments.listen});
  if (!keys.ok()) return keys.status();
  const auto open_at = [&](const std::string& address) {
    return WebServer::open(address, Hosts(arguments.hosts), *keys, client, arguments.page);
  };
  absl::StatusOr<std::unique_ptr<WebServer>> server = open_at(arguments.listen);
  if (server.ok() || !arguments.any_port) return server;
  return open_at(with_port(arguments.listen, 0));
}

absl::Status serve(const Arguments& arguments, Client& client, const std::function<void()>& wait) {
  raise_open_files_max();
  const absl::StatusOr<std::unique_ptr<WebServer>> server = open(arguments, client);
  if (!server.ok()) return server.status();
  const std::string& url = (*server)->url();
  if (!arguments.ready_file.empty()) {
    if (absl::Status status = write_ready_file(arguments.ready_file, url); !status.ok()) return status;
  }
  std::printf("the web UI is at %s\n", url.c_str());
  std::fflush(stdout);
  wait();
  return absl::OkStatus();
}

}  // namespace
}  // namespace tessera::viewer

int main(int argc, char** argv) {
  using namespace tessera;
  viewer::Arguments arguments;
  const pid_t parent = getppid();
  CLI::App app("Shows the world of a cluster in a browser.", "tessera-viewer");
  app.footer("Example: tessera-viewer --connect 127.0.0.1:7300 --listen 127.0.0.1:7380 --read-only");
  viewer::add_options(app, arguments);
  return live::run_client(app, argc, argv, arguments.client,
                          [&](Client& client, const std::function<void()>& wait) -> absl::Status {
                            arguments.page.looks = std::make_shared<viewer::FileLooks>(arguments.looks);
                            arguments.page.shelf = viewer::shelf_of(arguments);
                            arguments.page.recorder = viewer::recorder_of(arguments);
                            if (arguments.exit_with_parent && !end_with_parent(parent, SIGTERM)) {
                              return absl::CancelledError("the process that started this one has ended");
                            }
                            return viewer::serve(arguments, client, wait);
                          });
}
