// Waits for SIGINT and SIGTERM.
#pragma once

#include <signal.h>

namespace tessera {

// Construct it before any other thread starts: the threads inherit the blocked signals.
class EndSignals {
 public:
  EndSignals();

  // Blocks until a signal arrives.
  void wait() const;

 private:
  sigset_t set_;
};

}  // namespace tessera
