#include "cli/prove.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cmath>
#include <filesystem>
#include <system_error>

#include "cli/child_process.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/terminal.h"
#include "cli/text.h"

namespace tessera::cli {
namespace {

// The command line that asks for the same world and time, with the settings in a file of `folder`. Doubles
// are written so that they are read back alike.
absl::StatusOr<std::vector<std::string>> arguments_of(const RunOptions& options,
                                                      const std::filesystem::path& folder) {
  const std::filesystem::path settings = folder / "settings.json";
  if (absl::Status status = write_json(settings, to_json(options.overrides.knobs)); !status.ok())
    return status;
  const SectorOffset& shift = options.overrides.shift;
  return std::vector<std::string>{"run",
                                  options.world.string(),
                                  "--seconds",
                                  absl::StrFormat("%.17g", options.seconds),
                                  "--settings",
                                  settings.string(),
                                  absl::StrCat("--shift=", shift.i, ",", shift.j, ",", shift.k)};
}

absl::StatusOr<ChildProcess> start(std::vector<std::string> arguments, const std::string& mode,
                                   const std::filesystem::path& folder) {
  arguments.push_back("--" + mode);
  arguments.push_back("--json");
  arguments.push_back((folder / (mode + ".json")).string());
  return ChildProcess::start(executable_folder() / "tessera", arguments, folder / (mode + ".log"));
}

absl::StatusOr<RunReport> finish(ChildProcess& child, const std::filesystem::path& json_file) {
  while (!child.ended()) {
    if (wait_readable({interrupt_descriptor(), child.descriptor()}, absl::InfiniteDuration()) == 0u) {
      return absl::CancelledError("interrupted");
    }
  }
  if (*child.ended() != 0) return absl::InternalError(child.epitaph());
  const absl::StatusOr<nlohmann::json> json = read_json(json_file);
  if (!json.ok()) return json.status();
  return report_from_json(*json);
}

std::string metres(double value) {
  return std::isfinite(value) ? absl::StrFormat("%.4g m", value) : "infinite";
}

std::string share(std::size_t part, std::size_t all) {
  return absl::StrCat(grouped(part), " of ", grouped(all));
}

std::vector<std::string> column(const std::string& title, const RunReport& report) {
  const MovementReport movement = report.movement.value_or(MovementReport{});
  std::vector<std::string> cells = {title, metres(movement.coordinate_max), metres(movement.coordinate_step),
                                    share(movement.moved, movement.bodies)};
  if (report.towers) {
    cells.insert(cells.end(),
                 {share(report.towers->standing, report.towers->towers),
                  metres(report.towers->displacement_median), metres(report.towers->displacement_max)});
  }
  return cells;
}

nlohmann::json outcome(const RunReport& report) {
  nlohmann::json json = nlohmann::json::object();
  if (report.movement) json["movement"] = to_json(*report.movement);
  if (report.towers) json["towers"] = to_json(*report.towers);
  return json;
}

}  // namespace

absl::StatusOr<Proof> prove(const RunOptions& options, const RunReport& run) {
  absl::StatusOr<std::filesystem::path> folder = make_temporary_folder();
  if (!folder.ok()) return folder.status();
  const absl::Cleanup remove_folder = [&folder] {
    std::error_code ignored;
    std::filesystem::remove_all(*folder, ignored);
  };
  const absl::StatusOr<std::vector<std::string>> arguments = arguments_of(options, *folder);
  if (!arguments.ok()) return arguments.status();
  absl::StatusOr<ChildProcess> plain = start(*arguments, "plain", *folder);
  if (!plain.ok()) return plain.status();
  absl::StatusOr<RunReport> in_process = run;
  if (!options.in_process) {
    absl::StatusOr<ChildProcess> child = start(*arguments, "in-process", *folder);
    if (!child.ok()) return child.status();
    in_process = finish(*child, *folder / "in-process.json");
    if (!in_process.ok()) return in_process.status();
  }
  absl::StatusOr<RunReport> plain_report = finish(*plain, *folder / "plain.json");
  if (!plain_report.ok()) return plain_report.status();
  return Proof{*std::move(in_process), *std::move(plain_report)};
}

bool holds(const Proof& proof, const RunReport& run) {
  return proof.in_process.world_hash == run.world_hash && proof.in_process.program_hash == run.program_hash &&
         proof.in_process.ticks == run.ticks;
}

std::string to_text(const Proof& proof, const RunReport& run) {
  std::string text;
  if (run.mode != "in-process") {
    const std::string verdict = holds(proof, run) ? coloured("the same bits", Colour::kGreen)
                                                  : coloured("NOT the same bits", Colour::kRed);
    absl::StrAppend(&text, "in one process        ", proof.in_process.world_hash, "  ", verdict, "\n");
  }
  std::vector<std::string> names = {"", "coordinates up to", "rounded to",
                                    absl::StrFormat("bodies that moved by %g m", kMovedMin)};
  if (proof.in_process.towers) {
    names.insert(names.end(), {"towers standing", "their displacement, median", "their displacement, most"});
  }
  const std::vector<std::string> ours = column("Tessera", proof.in_process);
  const std::vector<std::string> plain = column("plain Bullet", proof.plain);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t row = 0; row < names.size(); ++row) rows.push_back({names[row], ours[row], plain[row]});
  absl::StrAppend(&text, "\n", table(rows, {false, true, true}));
  if (proof.in_process.towers) {
    absl::StrAppendFormat(
        &text,
        "A tower stands if its top body is less than %g m from where it began; displacements are "
        "those of all bodies of towers.\n",
        kStandingDisplacementMax);
  }
  absl::StrAppend(&text,
                  "Plain Bullet is one world of single precision, every body at its absolute coordinates.\n");
  return text;
}

nlohmann::json to_json(const Proof& proof, const RunReport& run) {
  nlohmann::json json = {{"in_process_hash", proof.in_process.world_hash}, {"same_bits", holds(proof, run)}};
  json["tessera"] = outcome(proof.in_process);
  json["plain_bullet"] = outcome(proof.plain);
  return json;
}

}  // namespace tessera::cli
