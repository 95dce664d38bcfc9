#include "daemon/parent_process.h"

#include <sys/prctl.h>
#include <unistd.h>

namespace tessera {

bool end_with_parent(pid_t parent, int signal) {
  prctl(PR_SET_PDEATHSIG, signal);
  return getppid() == parent;
}

}  // namespace tessera
