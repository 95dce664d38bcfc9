// `tessera run`: a world from its file to its report.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <memory>

#include "cli/check_programs.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/prepared_run.h"
#include "cli/prove.h"
#include "cli/run_cluster.h"
#include "cli/run_local.h"
#include "cli/world_options.h"
#include "daemon/parse_command_line.h"

namespace tessera::cli {
namespace {

absl::StatusOr<RunReport> simulate(const RunOptions& options) {
  if (options.plain) return run_plain(options);
  return options.in_process ? run_in_process(options) : run_cluster(options);
}

absl::Status check(RunOptions options, nlohmann::json& json) {
  options.trajectory = {};
  const absl::StatusOr<PreparedRun> run = prepare(options, "check");
  if (!run.ok()) return run.status();
  const absl::StatusOr<CheckedPrograms> checked = check_programs(run->loaded.world, run->report.ticks);
  if (!checked.ok()) return checked.status();
  absl::PrintF("%s", to_text(*checked));
  json["programs_checked"] = checked->ticks;
  return absl::OkStatus();
}

absl::Status run(const RunOptions& options) {
  catch_interrupts();
  const absl::StatusOr<RunReport> report = simulate(options);
  if (!report.ok()) return report.status();
  absl::PrintF("%s", to_text(*report));
  std::fflush(stdout);
  nlohmann::json json = to_json(*report);
  absl::Status outcome;
  if (options.prove) {
    const absl::StatusOr<Proof> proof = prove(options, *report);
    if (!proof.ok()) return proof.status();
    absl::PrintF("%s", to_text(*proof, *report));
    json["proof"] = to_json(*proof, *report);
    if (!holds(*proof, *report))
      outcome = absl::InternalError("the cluster and one process ended in different bits");
  }
  if (options.check_programs) outcome.Update(check(options, json));
  if (report->counts.diverged > 0 && !options.allow_divergence) {
    outcome.Update(absl::OutOfRangeError(absl::StrCat(
        "bodies diverged, and were stopped, ", report->counts.diverged,
        report->counts.diverged == 1 ? " time" : " times", " (--allow-divergence accepts that)")));
  }
  if (!options.json.empty()) outcome.Update(write_json(options.json, json));
  return outcome;
}

void add_trajectory_options(CLI::App& command, TrajectoryOptions& options) {
  CLI::Option* trajectory =
      add_parsed(command, "--trajectory", options.file, parse_output_file,
                 "write where bodies are and how they move to this file, in CSV: a row a body and tick");
  add_parsed(command, "--bodies", options.bodies, parse_globs,
             "GLOB,...: of the bodies with such names; otherwise of all that are not static")
      ->needs(trajectory);
  command.add_option("--every", options.every, "of ticks that are multiples of this, and the first")
      ->check(CLI::Range(std::uint32_t{1}, kTrajectoryEveryMax))
      ->capture_default_str()
      ->needs(trajectory);
}

}  // namespace

void add_run_command(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "run", "Simulate a world file as fast as possible, and report.",
      "tessera run worlds/earth.sdf --servers 4 --seconds 10 --shift 2^40,0,-2^62 --json earth.json");
  const auto options = std::make_shared<RunOptions>();
  CLI::Option* world = command.add_option("world", options->world, kWorldFile);
  CLI::Option* from =
      command.add_option("--from", options->from, "a snapshot to go on from, in the place of a world")
          ->excludes(world);
  CLI::Option* servers =
      command.add_option("--servers", options->servers, "sector servers to start, each a process")
          ->check(CLI::Range(1, 64))
          ->capture_default_str();
  CLI::Option* in_process =
      command.add_flag("--in-process", options->in_process, "without any daemon, in this process");
  CLI::Option* plain = command.add_flag("--plain", options->plain,
                                        "without sectors: one plain Bullet world of single precision");
  in_process->excludes(servers)->excludes(plain);
  plain->excludes(servers)->excludes(from);
  command
      .add_option("--threads", options->threads, "threads of each process; by default the cores, shared out")
      ->check(CLI::Range(1, 256));
  command.add_option("--seconds", options->seconds, "simulated time, s")
      ->check(number_within(0.0, 1e9))
      ->capture_default_str();
  add_override_options(command, options->overrides);
  command
      .add_flag("--prove", options->prove,
                "afterwards compare with the same run in one process, bit by bit, and with plain Bullet")
      ->excludes(plain)
      ->excludes(from);
  command
      .add_flag("--check-programs", options->check_programs,
                "afterwards run the world on one server, on three that are shuffled, and restored in the "
                "middle, in "
                "this process, and compare programs and bodies at every tick")
      ->excludes(plain)
      ->excludes(from);
  add_parsed(command, "--snapshot", options->snapshot, parse_output_file,
             "write all of the world at the end to this file: a snapshot")
      ->excludes(plain);
  add_trajectory_options(command, options->trajectory);
  command.add_flag("--allow-divergence", options->allow_divergence,
                   "succeed even if bodies leave the range of numbers, speeds or sectors");
  add_parsed(command, "--json", options->json, parse_output_file, "write the report to this file, too");
  command.callback([options, world, from, &action] {
    if (world->count() + from->count() == 0) throw CLI::RequiredError("world, or --from FILE,");
    action = [options] { return run(*options); };
  });
}

}  // namespace tessera::cli
