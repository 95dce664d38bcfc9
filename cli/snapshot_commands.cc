// Snapshots of the world of a cluster: snapshot, restore.
#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_format.h>

#include <filesystem>
#include <memory>
#include <system_error>
#include <vector>

#include "cli/child_process.h"
#include "cli/connection.h"
#include "cli/snapshot_difference.h"
#include "cli/status_text.h"
#include "cli/text.h"
#include "proto/snapshot_file.h"

namespace tessera::cli {
namespace {

absl::Status compare(Client& client, const std::filesystem::path& file, nlohmann::json& data) {
  const absl::StatusOr<std::vector<v1::SnapshotChunk>> written = read_snapshot(file);
  if (!written.ok()) return written.status();
  const absl::StatusOr<std::filesystem::path> folder = make_temporary_folder();
  if (!folder.ok()) return folder.status();
  const absl::Cleanup remove_folder = [&folder] {
    std::error_code ignored;
    std::filesystem::remove_all(*folder, ignored);
  };
  if (const auto taken = client.snapshot(*folder / "live"); !taken.ok()) return taken.status();
  const absl::StatusOr<std::vector<v1::SnapshotChunk>> live = read_snapshot(*folder / "live");
  if (!live.ok()) return live.status();
  const absl::StatusOr<std::string> difference = snapshot_difference(*written, *live);
  if (!difference.ok()) return difference.status();
  data = {{"equal", difference->empty()}};
  if (!difference->empty()) return absl::InternalError(*difference);
  absl::PrintF("the world of the cluster is that of %s, bit by bit, at tick %d\n", file.string(),
               live->front().head().tick());
  return absl::OkStatus();
}

absl::Status save(Client& client, const std::filesystem::path& file, nlohmann::json& data) {
  const absl::StatusOr<SnapshotSummary> summary = client.snapshot(file);
  if (!summary.ok()) return summary.status();
  data = {{"tick", summary->tick}, {"bytes", summary->bytes}};
  absl::PrintF("%s: tick %d, %s\n", file.string(), summary->tick,
               megabytes(static_cast<double>(summary->bytes)));
  return absl::OkStatus();
}

}  // namespace

void add_snapshot_commands(CLI::App& app, Action& action) {
  CLI::App& snapshot =
      add_command(app, "snapshot", "Write the whole state of the world to a file, whether it runs or not.",
                  "tessera snapshot city.snapshot\n  tessera snapshot city.snapshot --compare");
  struct SnapshotOptions {
    std::filesystem::path file;
    bool compare = false;
    bool replace = false;
  };
  const auto saved = std::make_shared<SnapshotOptions>();
  snapshot.add_option("file", saved->file, "to write; one that exists is replaced")->required();
  snapshot.add_flag("--compare", saved->compare,
                    "read the file instead, and compare: ends with 1 where the world differs in any bit");
  on_cluster(snapshot, action, [saved](Client& client, nlohmann::json& data) {
    return saved->compare ? compare(client, saved->file, data) : save(client, saved->file, data);
  });

  CLI::App& restore = add_command(app, "restore",
                                  "Load the world of a snapshot, paused at its tick; it continues with the "
                                  "same bits on any number of servers.",
                                  "tessera restore city.snapshot --replace");
  const auto restored = std::make_shared<SnapshotOptions>();
  restore.add_option("file", restored->file, "of tessera snapshot")->required();
  restore.add_flag("--replace", restored->replace, "also where a world is loaded already");
  on_cluster(restore, action, [restored](Client& client, nlohmann::json& data) -> absl::Status {
    const absl::StatusOr<LoadSummary> summary = client.restore(restored->file, restored->replace);
    if (!summary.ok()) return summary.status();
    absl::PrintF("%s: %s bodies, %s sectors, on %d server%s\n", restored->file.string(),
                 grouped(summary->bodies), grouped(summary->sectors), summary->servers,
                 summary->servers == 1 ? "" : "s");
    data = {{"bodies", summary->bodies}, {"sectors", summary->sectors}, {"servers", summary->servers}};
    return absl::OkStatus();
  });
}

}  // namespace tessera::cli
