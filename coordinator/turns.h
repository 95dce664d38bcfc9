// Two or more coordinators of one cluster: this one leads, or stands by for the one that does.
#pragma once

#include "coordinator/options.h"

namespace tessera {

// Takes part, with --etcd, until the process is asked to end or the cluster ends. Returns the exit code.
int take_turns(CoordinatorArguments& arguments);

}  // namespace tessera
