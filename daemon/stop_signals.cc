#include "daemon/stop_signals.h"

#include <pthread.h>

#include <utility>

namespace tessera {

StopSignals::StopSignals(std::function<void()> on_stop)
    : on_stop_(std::move(on_stop)), thread_([this] {
        signals_.wait();
        wanted_ = true;
        on_stop_();
      }) {}

StopSignals::~StopSignals() {
  pthread_kill(thread_.native_handle(), SIGTERM);  // ends the wait, if it is still waiting
  thread_.join();
}

}  // namespace tessera
