#include "cli/world_options.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/string_view.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "cli/command.h"
#include "client_sdk/arguments/parse.h"

namespace tessera::cli {

absl::StatusOr<Precision> parse_precision(const std::string& text) {
  if (const auto precision = precision_named(text)) return *precision;
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is neither f32 nor f64"));
}

absl::StatusOr<Knobs> read_knobs(const std::string& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return absl::InvalidArgumentError(absl::StrCat(file, " is a folder, not a file of settings"));
  }
  std::ifstream in(file);
  if (!in) return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", file));
  std::string text(kSettingsFileBytesMax + 1, '\0');  // one more, so that a larger file is refused
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  absl::StatusOr<Knobs> knobs = knobs_from_text(text);
  if (knobs.ok()) return knobs;
  return absl::Status(knobs.status().code(), absl::StrCat(file, ": ", knobs.status().message()));
}

namespace {

// Short names that some settings have besides their own.
constexpr std::pair<absl::string_view, absl::string_view> kAliases[] = {{"precision", "--engine"},
                                                                        {"time_step", "--dt"}};

std::string flag_of(absl::string_view name) {
  return absl::StrCat("--", absl::StrReplaceAll(name, {{"_", "-"}}));
}

// "--time-step,--dt"
std::string flags_of(const WorldSetting& setting) {
  std::string flags = flag_of(setting.name);
  for (const auto& [name, alias] : kAliases) {
    if (name == setting.name) absl::StrAppend(&flags, ",", alias);
  }
  return flags;
}

std::string help_of(const WorldSetting& setting) {
  const std::string unit = *setting.unit == '\0' ? "" : absl::StrCat(" ", setting.unit);
  return absl::StrCat(setting.help, " (", bounds_of(setting), unit, "; ", text_of(setting, WorldSettings()),
                      unit, " where the file has none)");
}

}  // namespace

// Options are applied in the order in which they are added: those of the command line come after the file.
void add_override_options(CLI::App& command, WorldOverrides& overrides) {
  Knobs& knobs = overrides.knobs;
  add_parsed(command, "--settings", knobs, read_knobs,
             "file of settings, as `tessera tune` writes it; options on the command line come on top");
  for (const WorldSetting& setting : kSettings) {
    const std::string flags = flags_of(setting);
    const auto set = [flags, &setting, &knobs](const std::string& text) {
      const absl::Status status = knobs.set_from_text(setting, text);
      if (!status.ok()) throw CLI::ValidationError(flags, std::string(status.message()));
    };
    CLI::Option* option = command.add_option_function<std::string>(flags, set, help_of(setting));
    if (setting.of_policy_clone) option->group("Policy clone (--seams clone)");
  }
  command.add_flag("--strict", overrides.strict,
                   "refuse a world file with faults that would otherwise be mended and reported, and one of "
                   "which something would "
                   "be left out, such as models of the network that are not on this machine");
  add_parsed(command, "--shift", overrides.shift, parse_shift,
             "I,J,K: move the world by whole sectors, up to 2^62 along each axis; 2^40 may be written so");
}

std::string options_of(const WorldOverrides& overrides) {
  std::string options;
  const nlohmann::ordered_json knobs = to_json(overrides.knobs);
  for (const auto& [name, value] : knobs.items()) {
    absl::StrAppend(&options, " ", flag_of(name), " ",
                    value.is_string() ? value.get<std::string>() : value.dump());
  }
  if (overrides.strict) absl::StrAppend(&options, " --strict");
  const SectorOffset& shift = overrides.shift;
  if (shift != SectorOffset{}) absl::StrAppend(&options, " --shift=", shift.i, ",", shift.j, ",", shift.k);
  return options;
}

}  // namespace tessera::cli
