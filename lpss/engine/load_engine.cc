#include "lpss/engine/load_engine.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <dlfcn.h>

#include <mutex>
#include <optional>

#include "lpss/base/shared_module.h"

namespace tessera {
namespace {

using MakeEngine = Engine*(const EngineSettings*);

struct LoadedModule {
  Precision precision;
  MakeEngine* make_engine;
};

const char* module_name(Precision precision) {
  return precision == Precision::kFloat32 ? "libtessera-engine-f32.so" : "libtessera-engine-f64.so";
}

const char* target_name(Precision precision) {
  return precision == Precision::kFloat32 ? "tessera-engine-f32" : "tessera-engine-f64";
}

absl::StatusOr<LoadedModule> load_module(Precision precision) {
  const absl::StatusOr<void*> module =
      load_shared_module(module_name(precision), "tessera_engine_interface", TESSERA_ENGINE_INTERFACE);
  if (!module.ok())
    return absl::NotFoundError(absl::StrCat("no physics engine of precision ", name_of(precision),
                                            "; in a clone, deploy/build.sh release ", target_name(precision),
                                            " builds it: ", module.status().message()));
  void* const make_engine = dlsym(*module, "tessera_make_engine");
  if (make_engine == nullptr)
    return absl::NotFoundError(absl::StrCat("no physics engine: ", module_name(precision), " has no entry"));
  return LoadedModule{precision, reinterpret_cast<MakeEngine*>(make_engine)};
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
