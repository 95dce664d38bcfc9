// tessera: run worlds, start clusters, and drive and watch them.
#include <vector>

#include "cli/application.h"
#include "cli/command.h"
#include "cli/config_command.h"
#include "lpss/base/freed_memory.h"
#include "tiles/tile_folder.h"

namespace tessera::cli {
namespace {

struct Group {
  const char* title;
  std::vector<const char*> commands;
};

// As the help lists them.
void put_in_groups(CLI::App& app) {
  const Group groups[] = {
      {"Simulate", {"run", "tune", "convert", "replay", "experiment", "simulate"}},
      {"Clusters", {"up", "status", "top", "drain", "balance", "shutdown", "store", "keys", "config"}},
      {"The world of a cluster",
       {"load", "unload", "pause", "resume", "step", "snapshot", "restore", "hash"}},
      {"Bodies", {"spawn", "remove", "velocity", "impulse", "force", "belt", "teleport", "target", "apply"}},
      {"Joints and programs", {"joints", "drive", "programs", "tell", "program"}},
      {"Queries", {"find", "watch", "raycast", "near"}},
  };
  for (const Group& group : groups) {
    for (const char* name : group.commands) app.get_subcommand(name)->group(group.title);
  }
}

int run(int argc, char** argv) {
  CLI::App app("Rigid-body simulation in worlds of any size, on any number of servers.", "tessera");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  tessera run worlds/earth.sdf --servers 2 --seconds 10\n"
      "  tessera up --servers 2\n"
      "  tessera load worlds/seam.sdf\n"
      "  tessera help run");
  Action action;
  add_run_command(app, action);
  add_cluster_commands(app, action);
  add_apply_command(app, action);
  add_body_commands(app, action);
  add_joint_commands(app, action);
  add_program_commands(app, action);
  add_program_check(app, action);
  add_snapshot_commands(app, action);
  add_status_commands(app, action);
  add_store_commands(app, action);
  add_query_commands(app, action);
  add_keys_commands(app, action);
  add_convert_command(app, action);
  add_simulate_command(app, action);
  add_replay_command(app, action);
  add_tune_command(app, action);
  add_experiment_command(app, action);
  add_config_command(app, action);
  put_in_groups(app);
  return run_application(app, argc, argv, action);
}

}  // namespace
}  // namespace tessera::cli

int main(int argc, char** argv) {
  tessera::keep_freed_memory();
  tessera::use_tile_folders();
  return tessera::cli::run(argc, argv);
}
