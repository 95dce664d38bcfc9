// Shared libraries that a process loads when it needs them.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

namespace tessera {

// Loads the library of this file name: from the folder of the executable, from that of the library that holds
// this code, from that named by TESSERA_ENGINE_DIR, from ../lib/tessera beside the executable, or from where
// the executable says that its libraries are. Classes cross the border between a process and a library: the
// function `interface_function` in it must return `interface`, so that both are of one build. It is never
// unloaded. The handle for dlsym(); NOT_FOUND, with what is wrong at each place.
absl::StatusOr<void*> load_shared_module(const char* file_name, const char* interface_function,
                                         absl::string_view interface);

}  // namespace tessera
