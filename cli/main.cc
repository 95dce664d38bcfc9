// tessera: run worlds, start clusters, and drive and watch them.
#include "cli/application.h"
#include "cli/command.h"
#include "cli/config_command.h"
#include "lpss/base/freed_memory.h"
#include "tiles/tile_folder.h"

namespace tessera::cli {
namespace {

int run(int argc, char** argv) {
  CLI::App app("Rigid-body simulation in worlds of any size, on any number of servers.", "tessera");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  tessera run worlds/earth.sdf --servers 2 --seconds 10\n"
      "  tessera up --servers 2\n"
      "  tessera load worlds/seam.sdf\n"
      "  tessera run --help");
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
  return run_application(app, argc, argv, action);
}

}  // namespace
}  // namespace tessera::cli

int main(int argc, char** argv) {
  tessera::keep_freed_memory();
  tessera::use_tile_folders();
  return tessera::cli::run(argc, argv);
}
