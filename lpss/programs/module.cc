#include "lpss/programs/module.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <xxhash.h>

#include <fstream>
#include <map>
#include <mutex>
#include <shared_mutex>
#include <utility>

#include "lpss/model/checks.h"
#include "lpss/programs/module_program.h"
#include "lpss/programs/module_text.h"
#include "lpss/wasm/limits.h"
#include "lpss/wasm/sandbox.h"

namespace tessera {
namespace {

// Those that somebody has, by their kinds.
class LoadedModules {
 public:
  static LoadedModules& get() {
    static LoadedModules modules;
    return modules;
  }

  std::shared_ptr<const ModuleProgram> find(absl::string_view kind) const {
    const std::shared_lock lock(mutex_);
    const auto found = modules_.find(kind);
    return found == modules_.end() ? nullptr : found->second.lock();
  }

  std::shared_ptr<const ModuleProgram> find_by_name(absl::string_view name) const {
    const std::shared_lock lock(mutex_);
    std::shared_ptr<const ModuleProgram> only;
    for (const auto& [kind, module] : modules_) {
      std::shared_ptr<const ModuleProgram> one = module.lock();
      if (!one || one->name() != name) continue;
      if (only) return nullptr;
      only = std::move(one);
    }
    return only;
  }

  // The one that is there already; otherwise this one.
  absl::StatusOr<std::shared_ptr<const ModuleProgram>> add(std::shared_ptr<const ModuleProgram> added) {
    const std::unique_lock lock(mutex_);
    std::erase_if(modules_, [](const auto& one) { return one.second.expired(); });
    const auto [place, is_new] = modules_.try_emplace(std::string(added->kind()), added);
    if (is_new) return added;
    std::shared_ptr<const ModuleProgram> there = place->second.lock();
    if (!there) {
      place->second = added;
      return added;
    }
    if (there->bytes == added->bytes) return there;
    return refused("module ", added->kind(), ": another one has the same name and checksum");
  }

 private:
  mutable std::shared_mutex mutex_;
  std::map<std::string, std::weak_ptr<const ModuleProgram>, std::less<>> modules_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<const ProgramModule>> load_module(std::string bytes) {
  absl::StatusOr<wasm::SandboxedModule> code = wasm::sandboxed({bytes.data(), bytes.size()});
  if (!code.ok()) return code.status();
  absl::StatusOr<ModuleText> text = read_module_text(code->description);
  if (!text.ok()) return text.status();
  std::string kind = absl::StrFormat("%s@%016x", text->name, XXH3_64bits(bytes.data(), bytes.size()));
  return LoadedModules::get().add(std::make_shared<const ModuleProgram>(
      ProgramModule{std::move(kind), std::move(bytes)}, *std::move(text), *std::move(code)));
}

absl::StatusOr<std::shared_ptr<const ProgramModule>> load_module_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string bytes(wasm::kModuleBytesMax + 1, '\0');  // one more than it may have
  if (!stream.is_open() || std::filesystem::is_directory(file))
    return absl::NotFoundError(absl::StrCat("cannot read the module ", file.string()));
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module(std::move(bytes));
  if (!module.ok()) return in(absl::StrCat("module ", file.string()), module.status());
  return module;
}

absl::Status can_run(const ProgramModules& modules) {
  for (const std::shared_ptr<const ProgramModule>& module : modules) {
    if (absl::Status status = static_cast<const ModuleProgram&>(*module).can_run(); !status.ok())
      return status;
  }
  return absl::OkStatus();
}

std::shared_ptr<const Program> find_module(absl::string_view kind) {
  LoadedModules& modules = LoadedModules::get();
  if (std::shared_ptr<const Program> module = modules.find(kind)) return module;
  return modules.find_by_name(kind);
}

bool asks(const ProgramModule& module) { return static_cast<const ModuleProgram&>(module).asks(); }

std::int64_t instructions_of(const ProgramModule& module) {
  return static_cast<const ModuleProgram&>(module).instructions();
}

}  // namespace tessera
