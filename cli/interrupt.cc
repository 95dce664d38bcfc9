#include "cli/interrupt.h"

#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <thread>

namespace tessera::cli {
namespace {

constexpr int kPatience = 3;

std::atomic<int> interrupts = 0;
int event = -1;

void handle(int) {
  const int error = errno;
  if (++interrupts >= kPatience) _exit(1);
  const std::uint64_t one = 1;
  // Nothing could be done about a failure here; interrupted() tells in any case.
  if (write(event, &one, sizeof one) < 0) errno = 0;
  errno = error;
}

}  // namespace

void catch_interrupts() {
  if (event >= 0) return;
  event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  struct sigaction action = {};
  action.sa_handler = handle;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

void interrupt_at_end_of_input() {
  std::thread([] {
    char ignored[256];
    while (read(STDIN_FILENO, ignored, sizeof ignored) > 0) {
    }
    handle(SIGTERM);
  }).detach();
}

bool interrupted() { return interrupts > 0; }

int interrupt_descriptor() { return event; }

}  // namespace tessera::cli
