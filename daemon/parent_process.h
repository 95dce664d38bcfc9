// A process that another one started for its own use ends with it.
#pragma once

#include <sys/types.h>

namespace tessera {

// `signal` comes to this process when its parent ends, which `parent` was as main() began. False where it has
// ended already.
bool end_with_parent(pid_t parent, int signal);

}  // namespace tessera
