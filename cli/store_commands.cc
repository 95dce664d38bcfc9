// The store of a coordinator, without one: store check, store repair.
#include <absl/status/statusor.h>
#include <absl/strings/str_format.h>

#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/text.h"
#include "coordinator/folder_store.h"

namespace tessera::cli {
namespace {

struct StoreOptions {
  std::filesystem::path folder;
  std::filesystem::path json;
  bool drop_lost = false;
};

// What is stored, by its kind: a world as it was loaded, or a state of it.
nlohmann::json world_in(const StoredState& state) {
  if (const auto* world = std::get_if<v1::World>(&state)) return {{"world", world->name()}, {"tick", 0}};
  const v1::SnapshotHead& head = std::get<std::vector<v1::SnapshotChunk>>(state).front().head();
  return {{"world", head.name()}, {"tick", head.tick()}};
}

// The last tick that has commands, 0 where there are none.
std::uint64_t last_tick_of(const std::vector<v1::StoredInput>& inputs) {
  std::uint64_t last = 0;
  for (const v1::StoredInput& input : inputs) last = std::max(last, input.commands().tick());
  return last;
}

std::string reason_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string reason;
  std::getline(in, reason);
  return reason;
}

nlohmann::json describe(const StoreFiles& files, const StoreContents& contents) {
  nlohmann::json data = {{"folder", files.folder().string()},
                         {"damage", contents.damage()},
                         {"lost", contents.lost},
                         {"state_lost", ""},
                         {"inputs", contents.inputs.size()},
                         {"last_tick", last_tick_of(contents.inputs)},
                         {"failed", reason_in(files.aside_reason())}};
  if (contents.state.ok()) {
    data.update(world_in(*contents.state));
  } else if (contents.has_world()) {
    data["state_lost"] = std::string(contents.state.status().message());
  }
  data["whole"] =
      contents.damage().empty() && contents.lost.empty() && data["state_lost"].get<std::string>().empty();
  return data;
}

void print(const nlohmann::json& data, const StoreFiles& files) {
  const auto line = [](const char* name, const std::string& text) {
    if (!text.empty()) absl::PrintF("%-8s  %s\n", name, text);
  };
  line("store", data["folder"]);
  if (data.contains("world")) {
    line("world", absl::StrFormat("'%s' at tick %s", data["world"].get<std::string>(),
                                  grouped(data["tick"].get<std::uint64_t>())));
    line("inputs", absl::StrFormat("%s since then", grouped(data["inputs"].get<std::uint64_t>())));
  } else {
    line("world", data["state_lost"].get<std::string>().empty() ? "none" : "its state is lost");
  }
  for (const nlohmann::json& damage : data["damage"])
    line("damage", absl::StrCat(damage.get<std::string>(), "; its copy is whole"));
  line("lost", data["lost"]);
  line("lost", data["state_lost"]);
  const std::string failed = data["failed"];
  if (!failed.empty()) line("failed", absl::StrCat(files.aside().string(), ": ", failed));
}

// What is to be done, where there is something.
absl::Status verdict(const nlohmann::json& data) {
  const std::string folder = data["folder"];
  if (!data["state_lost"].get<std::string>().empty()) {
    return absl::DataLossError(
        "the state of the world is lost: have a coordinator begin with another folder, and restore a "
        "snapshot");
  }
  if (!data["lost"].get<std::string>().empty()) {
    return absl::DataLossError(
        absl::StrFormat("inputs are lost: `tessera store repair %s --drop-lost` keeps the state and the %s "
                        "inputs before them",
                        folder, grouped(data["inputs"].get<std::uint64_t>())));
  }
  if (!data["damage"].empty()) {
    return absl::DataLossError(absl::StrFormat(
        "damaged, and nothing is lost: a coordinator that starts, or `tessera store repair %s`, mends it",
        folder));
  }
  return absl::OkStatus();
}

absl::Status check(const StoreOptions& options) {
  const absl::StatusOr<StoreContents> contents = check_folder_store(options.folder);
  if (!contents.ok()) return contents.status();
  const StoreFiles files(options.folder);
  const nlohmann::json data = describe(files, *contents);
  print(data, files);
  if (!options.json.empty()) {
    if (absl::Status status = write_json(options.json, data); !status.ok()) return status;
  }
  absl::Status status = verdict(data);
  if (status.ok()) absl::PrintF("all of it is as it was written\n");
  return status;
}

absl::Status repair(const StoreOptions& options) {
  {
    const absl::StatusOr<StoreContents> contents = check_folder_store(options.folder);
    if (!contents.ok()) return contents.status();
    const nlohmann::json data = describe(StoreFiles(options.folder), *contents);
    if (!contents->lost.empty() && data["state_lost"].get<std::string>().empty() && options.drop_lost) {
      if (absl::Status status = drop_what_is_lost(options.folder); !status.ok()) return status;
    } else if (!contents->lost.empty() || (contents->has_world() && !contents->state.ok())) {
      return verdict(data);
    } else if (absl::Status status = open_folder_store(options.folder).status(); !status.ok()) {
      return status;
    }
  }
  return check(options);
}

void add_folder(CLI::App& command, StoreOptions& options) {
  command.add_option("folder", options.folder, "of `tessera-coordinator --store`; no coordinator may use it")
      ->required();
  add_parsed(command, "--json", options.json, parse_output_file,
             "write what is printed to this file as data, too");
}

}  // namespace

void add_store_commands(CLI::App& app, Action& action) {
  CLI::App& store = add_command(app, "store", "Check and repair the store of a stopped coordinator.",
                                "tessera store check /var/lib/tessera/store");
  store.require_subcommand(1);

  CLI::App& checked =
      add_command(store, "check",
                  "Read each byte of a store, and tell what it has, and what is damaged: ends "
                  "with 1 where something is.",
                  "tessera store check /var/lib/tessera/store");
  const auto check_options = std::make_shared<StoreOptions>();
  add_folder(checked, *check_options);
  checked.callback([check_options, &action] { action = [check_options] { return check(*check_options); }; });

  CLI::App& repaired = add_command(
      store, "repair", "Make good what copies stand for, and drop what is lost where that is asked for.",
      "tessera store repair /var/lib/tessera/store --drop-lost");
  const auto repair_options = std::make_shared<StoreOptions>();
  add_folder(repaired, *repair_options);
  repaired.add_flag("--drop-lost", repair_options->drop_lost,
                    "where inputs are lost: go on without them, and without those that came after");
  repaired.callback(
      [repair_options, &action] { action = [repair_options] { return repair(*repair_options); }; });
}

}  // namespace tessera::cli
