#include "viewer/world_requests.h"

#include <absl/strings/str_cat.h>

#include <filesystem>
#include <string>
#include <vector>

#include "worlds/loader/world_file.h"

namespace tessera::viewer {
namespace {

using nlohmann::json;

absl::StatusOr<json> told(const absl::StatusOr<LoadSummary>& loaded) {
  if (!loaded.ok()) return loaded.status();
  return json{{"bodies", loaded->bodies}, {"sectors", loaded->sectors}};
}

absl::StatusOr<json> load_file(Client& client, const PageOptions& options, const std::filesystem::path& file,
                               const LoadedWorld& world, bool replace) {
  absl::StatusOr<json> loaded = told(client.load(world.world, replace));
  if (loaded.ok()) options.looks->show(file);
  return loaded;
}

// Empty, or what differs: a setting of the cluster's world, or where it is.
std::string difference(const ClusterStatus& cluster, const WorldDescription& file) {
  if (cluster.world != file.name) return absl::StrCat("its name is ", file.name);
  for (const WorldSetting& setting : kSettings) {
    const std::string here = text_of(setting, *cluster.settings);
    const std::string there = text_of(setting, file.settings);
    if (here != there) return absl::StrCat(setting.name, " is ", there, " there and ", here, " here");
  }
  return cluster.anchor == file.anchor ? "" : "the world was moved when it was loaded";
}

}  // namespace

json worlds(const PageOptions& options) {
  json worlds = json::array();
  json snapshots = json::array();
  for (const ShelfWorld& world : options.shelf->worlds())
    worlds.push_back({{"name", world.name}, {"text", world.text}});
  for (const ShelfSnapshot& snapshot : options.shelf->snapshots())
    snapshots.push_back({{"name", snapshot.name}, {"bytes", snapshot.bytes}});
  return {{"worlds", std::move(worlds)},
          {"snapshots", std::move(snapshots)},
          {"keeps_snapshots", options.shelf->keeps_snapshots()}};
}

absl::StatusOr<json> load(Client& client, const PageOptions& options, const json& request) {
  const absl::StatusOr<std::filesystem::path> file =
      options.shelf->world(request.at("world").get<std::string>());
  if (!file.ok()) return file.status();
  const absl::StatusOr<LoadedWorld> world = load_world_file(*file);
  if (!world.ok()) return world.status();
  return load_file(client, options, *file, *world, request.value("replace", false));
}

absl::StatusOr<json> reset(Client& client, const live::ClusterReport& report, const PageOptions& options) {
  const ClusterStatus& cluster = report.cluster;
  if (!cluster.settings) return absl::FailedPreconditionError("no world is loaded");
  std::vector<std::filesystem::path> files = {options.looks->file()};
  if (const absl::StatusOr<std::filesystem::path> file = options.shelf->world(cluster.world); file.ok())
    files.push_back(*file);
  std::string why;
  for (const std::filesystem::path& file : files) {
    if (file.empty()) continue;
    const absl::StatusOr<LoadedWorld> world = load_world_file(file);
    if (!world.ok()) {
      why = std::string(world.status().message());
      continue;
    }
    const std::string other = difference(cluster, world->world);
    if (other.empty()) return load_file(client, options, file, *world, true);
    why = absl::StrCat(file.filename().string(), " has another world: ", other);
  }
  if (!why.empty()) return absl::FailedPreconditionError(why);
  return absl::NotFoundError(
      absl::StrCat("this web UI does not know the file of the world '", cluster.world, "'"));
}

absl::StatusOr<json> save(Client& client, const PageOptions& options, const json& request) {
  const std::string name = request.at("name").get<std::string>();
  const absl::StatusOr<std::filesystem::path> file = options.shelf->new_snapshot(name);
  if (!file.ok()) return file.status();
  const absl::StatusOr<SnapshotSummary> saved = client.snapshot(*file);
  if (!saved.ok()) return saved.status();
  return json{{"tick", saved->tick}, {"bytes", saved->bytes}};
}

json to_json(const RecorderState& state) {
  return {{"number", state.number}, {"is_recording", state.is_recording},
          {"name", state.name},     {"bytes", state.bytes},
          {"said", state.said},     {"is_whole", state.is_whole}};
}

absl::StatusOr<json> record(const PageOptions& options, const json& request) {
  if (absl::Status status = options.recorder->start(request.at("name").get<std::string>()); !status.ok())
    return status;
  return to_json(options.recorder->state());
}

absl::StatusOr<json> stop_recording(const PageOptions& options) {
  const absl::StatusOr<RecorderState> state = options.recorder->stop();
  if (!state.ok()) return state.status();
  return to_json(*state);
}

absl::StatusOr<json> restore(Client& client, const PageOptions& options, const json& request) {
  const absl::StatusOr<std::filesystem::path> file =
      options.shelf->snapshot(request.at("name").get<std::string>());
  if (!file.ok()) return file.status();
  return told(client.restore(*file, request.value("replace", false)));
}

}  // namespace tessera::viewer
