#include "lpss/base/shared_module.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

namespace tessera {
namespace {

using Interface = const char*();

// Of the program or library that holds this code, such as a module of Python.
std::filesystem::path own_folder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&own_folder), &info) == 0) return {};
  return std::filesystem::path(info.dli_fname).parent_path();
}

std::vector<std::filesystem::path> module_folders() {
  std::vector<std::filesystem::path> folders;
  std::error_code error;
  const std::filesystem::path executable = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(executable.parent_path());
  const std::filesystem::path own = own_folder();
  std::error_code unknown;
  if (!own.empty() && !std::filesystem::equivalent(own, executable.parent_path(), unknown)) {
    folders.push_back(own);
  }
  if (const char* named = std::getenv("TESSERA_ENGINE_DIR")) folders.emplace_back(named);
  if (!error) folders.push_back(executable.parent_path().parent_path() / "lib" / "tessera");
  return folders;
}

// The file in each of those folders; last its name alone, which the dynamic linker looks for.
std::vector<std::filesystem::path> module_files(const char* file_name) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& folder : module_folders()) files.push_back(folder / file_name);
  files.emplace_back(file_name);
  return files;
}

}  // namespace

absl::StatusOr<void*> load_shared_module(const char* file_name, const char* interface_function,
                                         absl::string_view interface) {
  std::vector<std::string> failures;
  for (const std::filesystem::path& file : module_files(file_name)) {
    std::error_code error;
    if (file.has_parent_path() && !std::filesystem::exists(file, error)) {
      failures.push_back(absl::StrCat(file.string(), " does not exist"));
      continue;
    }
    void* const module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) {
      failures.emplace_back(dlerror());
      continue;
    }
    void* const has = dlsym(module, interface_function);
    if (has != nullptr && reinterpret_cast<Interface*>(has)() == interface) return module;
    failures.push_back(absl::StrCat(file.string(), " is of another build of Tessera"));
    dlclose(module);
  }
  return absl::NotFoundError(absl::StrJoin(failures, "; "));
}

}  // namespace tessera
