// Loads the engine of one precision into this process.
#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "lpss/engine/engine.h"

namespace tessera {

// The Bullet engine of `settings.precision`. Bullet's two precisions share symbol names with different
// meanings, so a process can load only one of them: the module that load_shared_module() finds. NOT_FOUND if
// there is no module, or only of other builds, FAILED_PRECONDITION if the process has already loaded the
// other precision. Engines may be made any number of times; the module stays loaded.
absl::StatusOr<std::unique_ptr<Engine>> load_engine(const EngineSettings& settings);

}  // namespace tessera
