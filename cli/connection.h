// Subcommands that talk to a running cluster.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/text.h"
#include "tessera/client.h"

namespace tessera::cli {

inline constexpr const char* kAddressDefault = "127.0.0.1:7300";
inline constexpr absl::Duration kConnectTimeout = absl::Seconds(3);

// Gives `command` the options --connect and --json, and as its action: to `prepare`, to connect, to do
// `work`, and to write what `work` put into its second argument to the file that --json names.
inline void on_cluster(
    CLI::App& command, Action& action, std::function<absl::Status(Client&, nlohmann::json&)> work,
    std::function<absl::Status()> prepare = [] { return absl::OkStatus(); }) {
  struct Where {
    std::string address = kAddressDefault;
    std::string keys;
    std::filesystem::path json;
  };
  const auto where = std::make_shared<Where>();
  command
      .add_option("--connect", where->address,
                  "host:port of the coordinator; of several, all of them, separated by commas")
      ->envname("TESSERA_ADDRESS")
      ->capture_default_str();
  command.add_option("--keys", where->keys, "folder of `tessera keys create`, for a cluster with keys")
      ->envname("TESSERA_KEYS");
  add_parsed(command, "--json", where->json, parse_output_file,
             "write what is printed to this file as data, too");
  command.callback([where, work = std::move(work), prepare = std::move(prepare), &action] {
    action = [where, work, prepare]() -> absl::Status {
      if (absl::Status status = prepare(); !status.ok()) return status;
      const absl::StatusOr<std::unique_ptr<Client>> client =
          Client::connect(where->address, kConnectTimeout, where->keys);
      if (absl::IsUnavailable(client.status()) && where->address == kAddressDefault) {
        return absl::UnavailableError(
            absl::StrCat(client.status().message(), "; `tessera up` starts a cluster there"));
      }
      if (!client.ok()) return client.status();
      nlohmann::json data = nlohmann::json::object();
      if (const absl::Status status = work(**client, data); !status.ok())
        return absl::Status(status.code(), in_options(status.message()));
      return where->json.empty() ? absl::OkStatus() : write_json(where->json, data);
    };
  });
}

// A body as people name it: a number is an id, all else a name.
BodyName parse_body(const std::string& text);

// KIND, or KIND:NAME=NUMBER,...: INVALID_ARGUMENT or NOT_FOUND, with what there is. A kind may be the file of
// a module, FILE.wasm, which is added to `modules`: they must live as long as the record is used.
absl::StatusOr<ProgramRecord> parse_program(const std::string& text, ProgramModules& modules);

// "takes effect at tick 12"
absl::Status print_effect(const absl::StatusOr<Tick>& tick, nlohmann::json& data);

}  // namespace tessera::cli
