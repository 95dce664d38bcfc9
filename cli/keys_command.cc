// Keys of a cluster: keys create, add, show.
#include <absl/strings/str_format.h>

#include <memory>

#include "cli/command.h"
#include "keys/make_keys.h"

namespace tessera::cli {
namespace {

constexpr int kDaysMax = 3650;

void add_days(CLI::App& command, int& days) {
  command.add_option("--days", days, "how long certificates are valid")
      ->check(CLI::Range(1, kDaysMax))
      ->capture_default_str();
}

void add_create(CLI::App& keys, Action& action) {
  CLI::App& command = add_command(
      keys, "create",
      "Make an authority, and folders with its keys: for the daemons, the web UI, and clients of each role.",
      "tessera keys create lab-keys --host lab.example.org --host 10.0.0.1");
  const auto wanted = std::make_shared<NewKeys>();
  command.add_option("folder", wanted->folder, "that is not there yet")->required();
  command.add_option(
      "--host", wanted->hosts,
      "name or address by which browsers and scrapers reach web UI and metrics, besides localhost;\n"
      "other clients accept any host that has keys of the authority");
  add_days(command, wanted->days);
  command.callback([wanted, &action] {
    action = [wanted]() -> absl::Status {
      if (absl::Status status = make_keys(*wanted); !status.ok()) return status;
      const std::string folder = wanted->folder.string();
      absl::PrintF(
          "%s/daemon   for hosts of daemons: --keys, or `keys` in the configuration\n"
          "%s/viewer   for the host of the web UI\n"
          "%s/observe, %s/control, %s/admin\n"
          "         for clients of these roles: --keys or TESSERA_KEYS; `token` is for browsers and "
          "scrapers\n"
          "%s/authority\n"
          "         signs further keys (tessera keys add): keep it where no daemon runs\n",
          folder, folder, folder, folder, folder, folder);
      return absl::OkStatus();
    };
  });
}

void add_add(CLI::App& keys, Action& action) {
  CLI::App& command = add_command(keys, "add", "Make a folder with keys for one more client.",
                                  "tessera keys add keys dashboard --role observe");
  struct AddOptions {
    std::filesystem::path folder;
    std::string name;
    std::string role;
    int days = NewKeys().days;
  };
  const auto options = std::make_shared<AddOptions>();
  command.add_option("folder", options->folder, "of `tessera keys create`")->required();
  command.add_option("name", options->name, "of the client, and of its folder")->required();
  command
      .add_option("--role", options->role,
                  "observe, own (commands for the bodies that it spawned), control or admin")
      ->check(CLI::IsMember({"observe", "own", "control", "admin"}))
      ->required();
  add_days(command, options->days);
  command.callback([options, &action] {
    action = [options]() -> absl::Status {
      absl::Status status =
          add_client(options->folder, options->name, *parse_role(options->role), options->days);
      if (!status.ok()) return status;
      absl::PrintF(
          "%s is made; its certificate is known at once, its token after a restart of the daemons and the "
          "web UI with\n"
          "the new `tokens` of their folders\n",
          (options->folder / options->name).string());
      return absl::OkStatus();
    };
  });
}

void add_show(CLI::App& keys, Action& action) {
  CLI::App& command = add_command(keys, "show", "Certificates of such a folder: until when, for what.",
                                  "tessera keys show keys");
  const auto folder = std::make_shared<std::filesystem::path>();
  command.add_option("folder", *folder)->required();
  command.callback([folder, &action] {
    action = [folder]() -> absl::Status {
      const absl::StatusOr<std::string> text = describe_keys(*folder);
      if (!text.ok()) return text.status();
      absl::PrintF("%s", *text);
      return absl::OkStatus();
    };
  });
}

}  // namespace

void add_keys_commands(CLI::App& app, Action& action) {
  CLI::App& keys = add_command(
      app, "keys", "Create and inspect keys, which say who may observe, control or stop a cluster.",
      "tessera keys create keys");
  keys.require_subcommand(1);
  add_create(keys, action);
  add_add(keys, action);
  add_show(keys, action);
}

}  // namespace tessera::cli
