// Subcommands that talk to a running cluster.
#pragma once

#include <absl/status/status.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <string>

#include "client_sdk/cli/command.h"
#include "tessera/client.h"

namespace tessera::cli {

inline constexpr const char* kAddressDefault = "127.0.0.1:7300";
inline constexpr absl::Duration kConnectTimeout = absl::Seconds(3);

// Gives `command` the option --connect, and as its action: to connect, and then to do `work`.
inline void on_cluster(CLI::App& command, Action& action, std::function<absl::Status(Client&)> work) {
  const auto address = std::make_shared<std::string>(kAddressDefault);
  command.add_option("--connect", *address, "host:port of the coordinator")
      ->envname("TESSERA_ADDRESS")
      ->capture_default_str();
  command.callback([address, work = std::move(work), &action] {
    action = [address, work] {
      const absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(*address, kConnectTimeout);
      return client.ok() ? work(**client) : client.status();
    };
  });
}

// A body as people name it: a number is an id, all else a name.
BodyName parse_body(const std::string& text);

// "takes effect at tick 12"
absl::Status print_effect(const absl::StatusOr<Tick>& tick);

}  // namespace tessera::cli
