// tessera-experiments: measures what Tessera claims. `tessera experiment` runs it.
#include <absl/strings/str_format.h>

#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "cli/application.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/measure/own_process.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "cli/terminal.h"
#include "cli/world_options.h"
#include "experiments/catalogue.h"
#include "experiments/output.h"
#include "experiments/seams/command.h"
#include "lpss/base/freed_memory.h"

namespace tessera::experiments {
namespace {

struct CommandOptions {
  std::optional<Precision> precision;
  bool quick = false;
  std::string only;
  std::string worlds;
  std::filesystem::path json;
  std::filesystem::path csv;
};

std::vector<Precision> precisions(const CommandOptions& options) {
  if (options.precision) return {*options.precision};
  return {Precision::kFloat32, Precision::kFloat64};
}

// Long texts, such as all that a file's reader has to say, would push the rest out of sight.
std::string shortened(std::string cell) {
  constexpr std::size_t kLongest = 60;
  if (cell.size() <= kLongest) return cell;
  std::size_t end = kLongest - 3;
  while (end > 0 && (static_cast<unsigned char>(cell[end]) & 0xc0U) == 0x80U) --end;  // within a character
  return cell.substr(0, end) + "...";
}

std::vector<std::vector<std::string>> printed_cells(const std::vector<Row>& rows) {
  constexpr int kDigits = 4;
  std::vector<std::vector<std::string>> lines = to_cells(rows, kDigits);
  for (std::vector<std::string>& line : lines) {
    for (std::string& cell : line) cell = shortened(std::move(cell));
  }
  return lines;
}

void print(const Report& report) {
  constexpr std::size_t kRowsMax = 400;  // more are not printed
  for (const Table& rows : report.tables) {
    const bool printed = rows.rows.size() <= kRowsMax;
    absl::PrintF("%s\n%s\n", cli::coloured(rows.name, cli::Colour::kBold),
                 printed ? cli::table(printed_cells(rows.rows))
                         : absl::StrFormat("%d rows, for --json and --csv\n", rows.rows.size()));
  }
  for (const std::string& miss : report.misses)
    absl::PrintF("%s %s\n", cli::coloured("misses:", cli::Colour::kRed), miss);
}

// `end` is how the measurement ended: JSON says so where that was before its time.
absl::Status write_files(const CommandOptions& options, const Report& report, const absl::Status& end) {
  if (!options.json.empty()) {
    nlohmann::ordered_json json = to_json(report);
    if (!end.ok()) json["stopped"] = end.message();
    if (absl::Status status = cli::write_json(options.json, json); !status.ok()) return status;
  }
  if (options.csv.empty()) return absl::OkStatus();
  for (const Table& rows : report.tables) {
    const std::filesystem::path file = rows.name == "rows" ? options.csv : beside(options.csv, rows.name);
    if (absl::Status status = cli::write_text(file, to_csv(rows.rows)); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status measure(const Experiment& experiment, const CommandOptions& command) {
  cli::catch_interrupts();
  const char* folder = std::getenv("TESSERA_WORLDS");
  Measured all;
  for (const Precision precision : precisions(command)) {
    if (!all.status.ok()) break;
    ExperimentOptions options;
    options.precision = precision;
    options.quick = command.quick;
    options.only = command.only;
    options.worlds = command.worlds.empty() && folder != nullptr ? folder : command.worlds;
    const auto work = [&](const Progress& progress) { return experiment.measure(options, progress); };
    Measured part =
        in_own_process_keeping([&](const Keep& keep) { return cli::with_bar(experiment.name, work, keep); });
    all.report.append(std::move(part.report));
    all.status = std::move(part.status);
  }
  const std::size_t rows = all.report.rows();
  if (rows == 0 && !all.status.ok()) return all.status;
  if (!all.status.ok())
    all.status =
        absl::Status(all.status.code(), absl::StrFormat("%s after %d rows", all.status.message(), rows));
  if (!all.status.ok()) cli::clear_progress();
  print(all.report);
  absl::Status written = write_files(command, all.report, all.status);
  return written.ok() ? all.status : written;
}

void add_experiment(CLI::App& app, const Experiment& experiment, cli::Action& action) {
  CLI::App& command = cli::add_command(
      app, experiment.name, experiment.about,
      absl::StrFormat("tessera experiment %s --quick --json %s.json", experiment.name, experiment.name));
  const auto options = std::make_shared<CommandOptions>();
  add_parsed(command, "--engine", options->precision, cli::parse_precision, "f32 or f64; default: both");
  command.add_flag("--quick", options->quick, "fewer or shorter runs");
  if (experiment.has_scenes)
    command.add_option("--only", options->only,
                       "only the scenes whose `group name`, or files whose path, contains this text");
  if (experiment.has_worlds)
    command
        .add_option("--worlds", options->worlds,
                    "folder of world files, searched with all folders in it; default: TESSERA_WORLDS")
        ->check(CLI::ExistingDirectory);
  add_parsed(command, "--json", options->json, cli::parse_output_file, "write all tables to this file");
  add_parsed(command, "--csv", options->csv, cli::parse_output_file,
             "write the rows to this file, other tables to FILE_table next to it");
  command.callback([&experiment, options, &action] {
    action = [&experiment, options] { return measure(experiment, *options); };
  });
}

int run(int argc, char** argv) {
  CLI::App app("Measure what Tessera claims.", "tessera-experiments");
  app.footer("Example:\n  tessera experiment distance --quick --engine f32");
  app.require_subcommand(1);
  cli::Action action;
  seams::add_seams_command(app, action);
  for (const Experiment& experiment : all_experiments()) add_experiment(app, experiment, action);
  return cli::run_application(app, argc, argv, action);
}

}  // namespace
}  // namespace tessera::experiments

int main(int argc, char** argv) {
  tessera::keep_freed_memory();
  return tessera::experiments::run(argc, argv);
}
