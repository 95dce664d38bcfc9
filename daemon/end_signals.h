// SIGINT and SIGTERM as something to wait for.
#pragma once

#include <signal.h>

namespace tessera {

// To be made before any other thread, whose signals are then blocked, too.
class EndSignals {
 public:
  EndSignals();

  // Until one comes.
  void wait() const;

 private:
  sigset_t set_;
};

}  // namespace tessera
