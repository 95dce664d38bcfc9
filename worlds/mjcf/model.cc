#include "worlds/mjcf/model.h"

#include <absl/strings/str_cat.h>
#include <dlfcn.h>

#include <mutex>
#include <utility>

#include "lpss/base/shared_module.h"
#include "worlds/mjcf/document.h"

namespace tessera::mjcf {
namespace {

// Kinds of unknown attributes and elements of a file.
constexpr int kUnknownKindsMax = 1000;

struct Compiler {
  Compile* compile = nullptr;
  Delete* remove = nullptr;
};

absl::StatusOr<Compiler> load_compiler() {
  const absl::StatusOr<void*> module =
      load_shared_module("libtessera-mjcf.so", kInterfaceEntry, TESSERA_MJCF_INTERFACE);
  if (!module.ok()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "files of MuJoCo need libtessera-mjcf.so, and that the package libmujoco2.2.2; in a clone, "
        "deploy/build.sh release tessera-mjcf installs and builds them: ",
        module.status().message()));
  }
  return Compiler{reinterpret_cast<Compile*>(dlsym(*module, kCompileEntry)),
                  reinterpret_cast<Delete*>(dlsym(*module, kDeleteEntry))};
}

}  // namespace

absl::StatusOr<Model> compile(xml::File& file, Notices& notices) {
  static const absl::StatusOr<Compiler> kCompiler = load_compiler();
  if (!kCompiler.ok())
    return absl::Status(kCompiler.status().code(),
                        absl::StrCat(file.name(), ": ", kCompiler.status().message()));
  Document document(file);
  if (absl::Status status = document.read(notices); !status.ok()) return status;
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::string error;
  for (int n = 0; n < kUnknownKindsMax; ++n) {
    std::unique_ptr<mjModel, Delete*> model(kCompiler->compile(document.folder(), document.text(), error),
                                            kCompiler->remove);
    if (model != nullptr)
      return Model{std::move(model), document.model(), document.efforts(), document.has_time_step()};
    if (!document.drop_unknown(error, notices)) break;
  }
  return document.error(error);
}

}  // namespace tessera::mjcf
