// Ends a process together with the process that started it for its own use.
#pragma once

#include <sys/types.h>

namespace tessera {

// Sends `signal` to this process when its parent ends; `parent` is the parent at the start of main(). False
// if it has ended already.
bool end_with_parent(pid_t parent, int signal);

}  // namespace tessera
