#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <dlfcn.h>

#include "lpss/base/shared_module.h"
#include "lpss/wasm/engine.h"

namespace tessera::wasm {
namespace {

using GetEngine = Engine*();

absl::StatusOr<Engine*> loaded() {
  const absl::StatusOr<void*> module =
      load_shared_module("libtessera-wasm.so", "tessera_wasm_interface", TESSERA_WASM_INTERFACE);
  if (!module.ok())
    return absl::NotFoundError(absl::StrCat(
        "no engine for programs in WebAssembly; in a clone, deploy/build.sh release tessera-wasm builds it: ",
        module.status().message()));
  void* const get = dlsym(*module, "tessera_wasm_engine");
  if (get == nullptr) return absl::NotFoundError("the engine for programs in WebAssembly has no entry");
  return reinterpret_cast<GetEngine*>(get)();
}

}  // namespace

absl::StatusOr<Engine*> load_engine() {
  static const absl::StatusOr<Engine*> kEngine = loaded();
  return kEngine;
}

}  // namespace tessera::wasm
