#include "cli/world_options.h"

#include <absl/strings/str_cat.h>

#include <cerrno>
#include <fstream>

#include "cli/command.h"
#include "client_sdk/arguments/parse.h"

namespace tessera::cli {

absl::StatusOr<Precision> parse_precision(const std::string& text) {
  if (const auto precision = precision_named(text)) return *precision;
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is neither f32 nor f64"));
}

absl::StatusOr<SeamPolicy> parse_seams(const std::string& text) {
  if (const auto seams = seams_named(text)) return *seams;
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is neither island nor clone"));
}

absl::StatusOr<Knobs> read_knobs(const std::string& file) {
  std::ifstream in(file);
  if (!in) return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", file));
  const auto json = nlohmann::ordered_json::parse(in, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return absl::InvalidArgumentError(absl::StrCat(file, " is not JSON"));
  absl::StatusOr<Knobs> knobs = knobs_from_json(json);
  if (knobs.ok()) return knobs;
  return absl::Status(knobs.status().code(), absl::StrCat(file, ": ", knobs.status().message()));
}

// Options are applied in the order in which they are added: those of the command line come after the file.
void add_override_options(CLI::App& command, WorldOverrides& overrides) {
  Knobs& knobs = overrides.knobs;
  add_parsed(command, "--settings", knobs, read_knobs,
             "file of settings, as `tessera tune` writes it; options on the command line come on top");
  add_parsed(command, "--engine", knobs.precision, parse_precision, "f32 or f64, instead of the file's");
  command.add_option("--sector-size", knobs.sector_size, "edge of a sector, m, instead of the file's");
  add_parsed(command, "--seams", knobs.seams, parse_seams, "island or clone, instead of the file's");
  command.add_option("--clone-depth", knobs.clone_depth,
                     "how deep clones reach, with --seams clone, 0 to 8; 0: no clones at all");
  command.add_option("--island-cap", knobs.island_cap,
                     "islands across seams of more bodies are coupled pass by pass instead of solved whole");
  command.add_option("--shuffle", knobs.shuffle,
                     "a seed: sectors change servers, and islands their solvers, at random; 0: never");
  command.add_option("--dt", knobs.time_step, "time step, s, instead of the file's");
  command.add_option("--iterations", knobs.solver_iterations,
                     "passes over the contacts of an island, 1 to 1000");
  command.add_option("--substeps", knobs.substeps,
                     "small steps that these passes are divided among, 1 to 64");
  add_parsed(command, "--shift", overrides.shift, parse_shift,
             "I,J,K: move the world by whole sectors, up to 2^62 along each axis; 2^40 may be written so");
}

}  // namespace tessera::cli
