#include "lpss/engine/load_engine.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace tessera {
namespace {

using MakeEngine = Engine*(const EngineSettings*);
using EngineInterface = const char*();

struct LoadedModule {
  Precision precision;
  MakeEngine* make_engine;
};

const char* module_name(Precision precision) {
  return precision == Precision::kFloat32 ? "libtessera-engine-f32.so" : "libtessera-engine-f64.so";
}

std::vector<std::filesystem::path> module_folders() {
  std::vector<std::filesystem::path> folders;
  std::error_code error;
  const std::filesystem::path executable = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(executable.parent_path());
  if (const char* named = std::getenv("TESSERA_ENGINE_DIR")) folders.emplace_back(named);
  if (!error) folders.push_back(executable.parent_path().parent_path() / "lib" / "tessera");
  return folders;
}

// The module in each of those folders; last its name alone, which the dynamic linker looks for where the
// executable says that its libraries are.
std::vector<std::filesystem::path> module_files(Precision precision) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& folder : module_folders())
    files.push_back(folder / module_name(precision));
  files.emplace_back(module_name(precision));
  return files;
}

// Classes cross the border between this program and a module, so that both must be built from the same ones.
bool is_same_interface(void* interface) {
  return interface != nullptr &&
         std::string_view(reinterpret_cast<EngineInterface*>(interface)()) == TESSERA_ENGINE_INTERFACE;
}

absl::StatusOr<LoadedModule> load_module(Precision precision) {
  std::vector<std::string> failures;
  for (const std::filesystem::path& file : module_files(precision)) {
    std::error_code error;
    if (file.has_parent_path() && !std::filesystem::exists(file, error)) {
      failures.push_back(absl::StrCat(file.string(), " does not exist"));
      continue;
    }
    void* module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!module) {
      failures.emplace_back(dlerror());
      continue;
    }
    void* const interface = dlsym(module, "tessera_engine_interface");
    void* const make_engine = dlsym(module, "tessera_make_engine");
    if (make_engine && is_same_interface(interface))
      return LoadedModule{precision, reinterpret_cast<MakeEngine*>(make_engine)};
    failures.push_back(absl::StrCat(file.string(), " is of another build of Tessera"));
    dlclose(module);
  }
  return absl::NotFoundError(absl::StrCat("no physics engine: ", absl::StrJoin(failures, "; ")));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Engine>> load_engine(const EngineSettings& settings) {
  static std::mutex mutex;
  static std::optional<LoadedModule> loaded;
  const std::lock_guard lock(mutex);
  if (!loaded) {
    absl::StatusOr<LoadedModule> module = load_module(settings.precision);
    if (!module.ok()) return module.status();
    loaded = *module;
  }
  if (loaded->precision != settings.precision) {
    return absl::FailedPreconditionError(absl::StrCat(
        "this process has loaded the other precision and cannot load ", module_name(settings.precision)));
  }
  std::unique_ptr<Engine> engine(loaded->make_engine(&settings));
  if (!engine)
    return absl::InternalError(absl::StrCat(module_name(settings.precision), " is of the other precision"));
  return engine;
}

}  // namespace tessera
