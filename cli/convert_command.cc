// tessera convert: a world file, with what the command line changes of it, as a message.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <memory>

#include "cli/command.h"
#include "cli/text.h"
#include "cli/world_options.h"
#include "tessera/world_message.h"

namespace tessera::cli {
namespace {

struct ConvertOptions {
  std::filesystem::path world;
  std::filesystem::path output;
  WorldOverrides overrides;
};

absl::Status convert(const ConvertOptions& options) {
  if (options.output.extension() != ".pb") {
    return absl::InvalidArgumentError(
        absl::StrCat(options.output.string(), ": the name must end in .pb, by which a message is known"));
  }
  const absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  if (absl::Status status = write_world_message(options.output, loaded->world); !status.ok()) return status;
  absl::PrintF("%s: %s bodies, %s joints, in %s\n", loaded->world.name, grouped(loaded->world.bodies.size()),
               grouped(loaded->world.joints.size()), options.output.string());
  absl::PrintF("%s", file_notes(loaded->notices, loaded->repairs));
  return absl::OkStatus();
}

}  // namespace

void add_convert_command(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "convert",
      "Convert a world file to a message (tessera.v1.World), which clients in any language, `run` and "
      "`load` accept.",
      "tessera convert worlds/tower.sdf tower.pb --shift 2^40,0,0");
  const auto options = std::make_shared<ConvertOptions>();
  command.add_option("world", options->world, kWorldFile)->required();
  command.add_option("output", options->output, "file to write, NAME.pb")->required();
  add_override_options(command, options->overrides);
  command.callback([options, &action] { action = [options] { return convert(*options); }; });
}

}  // namespace tessera::cli
