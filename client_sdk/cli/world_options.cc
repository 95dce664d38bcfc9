#include "client_sdk/cli/world_options.h"

#include <absl/strings/str_cat.h>

#include "client_sdk/cli/command.h"
#include "client_sdk/cli/text.h"

namespace tessera::cli {

absl::StatusOr<Precision> parse_precision(const std::string& text) {
  if (text == "f32") return Precision::kFloat32;
  if (text == "f64") return Precision::kFloat64;
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is neither f32 nor f64"));
}

absl::StatusOr<SeamPolicy> parse_seams(const std::string& text) {
  if (text == "island") return SeamPolicy::kIsland;
  if (text == "clone") return SeamPolicy::kClone;
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is neither island nor clone"));
}

void add_override_options(CLI::App& command, WorldOverrides& overrides) {
  add_parsed(command, "--engine", overrides.precision, parse_precision, "f32 or f64, instead of the file's");
  command.add_option("--sector-size", overrides.sector_size, "edge of a sector, m, instead of the file's");
  add_parsed(command, "--seams", overrides.seams, parse_seams, "island or clone, instead of the file's");
  command.add_option("--clone-depth", overrides.clone_depth,
                     "how deep clones reach, with --seams clone, 0 to 8; 0: no clones at all");
  command.add_option("--island-cap", overrides.island_cap,
                     "islands across seams of more bodies are coupled pass by pass instead of solved whole");
  command.add_option("--shuffle", overrides.shuffle,
                     "a seed: sectors change servers, and islands their solvers, at random; 0: never");
  command.add_option("--dt", overrides.time_step, "time step, s, instead of the file's");
  add_parsed(command, "--shift", overrides.shift, parse_shift,
             "I,J,K: move the world by whole sectors, up to 2^62 along each axis; 2^40 may be written so");
}

}  // namespace tessera::cli
