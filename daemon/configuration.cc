#include "daemon/configuration.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>

#include "daemon/options.h"

namespace tessera {
namespace {

constexpr const char* kConfigVariable = "TESSERA_CONFIG";
constexpr std::array<const char*, 3> kSections = {"coordinator", "sector-server", "gateway"};

std::string section_of(const CLI::App& app) {
  return std::string(absl::StripPrefix(app.get_name(), "tessera-"));
}

std::string key_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? "" : option.get_lnames().front();
}

bool is_key(const CLI::Option& option) { return option.get_configurable() && !key_of(option).empty(); }
bool is_shared(const CLI::Option& option) { return option.get_group() == kSharedOptions; }

std::vector<const CLI::Option*> keys_of(const CLI::App& app, bool shared) {
  std::vector<const CLI::Option*> keys;
  for (const CLI::Option* option : app.get_options()) {
    if (is_key(*option) && is_shared(*option) == shared) keys.push_back(option);
  }
  return keys;
}

std::string variable_of(const CLI::App& app, const CLI::Option& option) {
  const std::string name =
      is_shared(option) ? key_of(option) : absl::StrCat(section_of(app), "-", key_of(option));
  return absl::StrCat("TESSERA_", absl::AsciiStrToUpper(absl::StrReplaceAll(name, {{"-", "_"}})));
}

const char* environment(const std::string& variable) {
  const char* value = std::getenv(variable.c_str());
  return value != nullptr && *value != '\0' ? value : nullptr;
}

// CLI11 reads the file; this selects the keys of one daemon.
class DaemonConfiguration : public CLI::ConfigBase {
 public:
  explicit DaemonConfiguration(const CLI::App& app) : app_(app) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    std::vector<CLI::ConfigItem> own;
    std::vector<CLI::ConfigItem> shared;
    for (CLI::ConfigItem& item : ConfigBase::from_config(input)) {
      if (item.name == "++" || item.name == "--") {  // a section begins or ends
        check_section(item);
        continue;
      }
      check_section(item);
      const bool in_section = !item.parents.empty();
      if (in_section && item.parents.front() != section_of(app_)) continue;
      const CLI::Option& option = option_of(item);
      item.parents.clear();
      if (environment(option.get_envname()) == nullptr)
        (in_section ? own : shared).push_back(std::move(item));
    }
    // CLI11 takes the first of two equal keys.
    own.insert(own.end(), shared.begin(), shared.end());
    return own;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw CLI::ConfigError(absl::StrCat(app_.get_config_ptr()->as<std::string>(), ": ", what));
  }

  void check_section(const CLI::ConfigItem& item) const {
    if (item.parents.empty()) return;
    const bool known = std::find(kSections.begin(), kSections.end(), item.parents.front()) != kSections.end();
    if (known && item.parents.size() == 1) return;
    refuse(absl::StrCat("there is no section [", absl::StrJoin(item.parents, "."), "]; there are [",
                        absl::StrJoin(kSections, "] and ["), "]"));
  }

  const CLI::Option& option_of(const CLI::ConfigItem& item) const {
    std::vector<const CLI::Option*> options = keys_of(app_, /*shared=*/true);
    if (!item.parents.empty()) {
      for (const CLI::Option* option : keys_of(app_, /*shared=*/false)) options.push_back(option);
    }
    for (const CLI::Option* option : options) {
      if (key_of(*option) == item.name) return *option;
    }
    const std::string place = item.parents.empty() ? "before the sections"
                                                   : absl::StrCat("in section [", item.parents.front(), "]");
    refuse(absl::StrCat("the key '", item.name, "' is not known ", place, "; known are ",
                        absl::StrJoin(options, ", ", [](std::string* out, const CLI::Option* option) {
                          absl::StrAppend(out, key_of(*option));
                        })));
  }

  const CLI::App& app_;
};

std::string described(const CLI::App& app, const CLI::Option& option) {
  const std::string key = key_of(option);
  const bool given = option.count() > 0;
  const std::vector<std::string> values =
      given ? option.results() : std::vector<std::string>{option.get_default_str()};
  return absl::StrCat("# ", option.get_description(), "\n# (--", key, ", ", variable_of(app, option), ")\n",
                      given ? "" : "#", key, " = ", CLI::detail::ini_join(values), "\n\n");
}

}  // namespace

void read_configuration(CLI::App& app) {
  const char* file = environment(kConfigVariable);
  app.set_config("--config", file != nullptr ? file : "",
                 absl::StrCat("Configuration file, in the format of `tessera config show` (Env:",
                              kConfigVariable, ")"),
                 /*config_required=*/file != nullptr)
      ->group(kSharedOptions);
  app.config_formatter(std::make_shared<DaemonConfiguration>(app));
  for (CLI::Option* option : app.get_options()) {
    if (is_key(*option)) option->envname(variable_of(app, *option));
  }
}

std::string configuration_text(const std::vector<const CLI::App*>& daemons) {
  std::string text =
      "# Configuration of Tessera's daemons: tessera-coordinator, tessera-sector-server and tessera-gateway\n"
      "# read it with --config FILE. Every key is the name of an option. The command line overrides the\n"
      "# environment, and the environment overrides this file. Commented keys show their default values.\n\n";
  for (const CLI::Option* option : keys_of(*daemons.front(), /*shared=*/true)) {
    absl::StrAppend(&text, described(*daemons.front(), *option));
  }
  for (const CLI::App* app : daemons) {
    absl::StrAppend(&text, "[", section_of(*app), "]\n\n");
    for (const CLI::Option* option : keys_of(*app, /*shared=*/false))
      absl::StrAppend(&text, described(*app, *option));
  }
  while (absl::EndsWith(text, "\n\n")) text.pop_back();
  return text;
}

}  // namespace tessera
