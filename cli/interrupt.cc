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

constexpr int kInterruptsMax = 3;
constexpr int kSignalled = 128;  // and the number of the signal: the exit code of what a signal ends

std::atomic<int> interrupts = 0;
std::atomic<int> first_signal = 0;
int event = -1;

// Nothing could be done about a failure to write; interrupted() tells in any case.
void tell() {
  const int error = errno;
  const std::uint64_t one = 1;
  if (write(event, &one, sizeof one) < 0) errno = 0;
  errno = error;
}

void handle(int signal) {
  int none = 0;
  first_signal.compare_exchange_strong(none, signal);
  if (++interrupts >= kInterruptsMax) _exit(kSignalled + first_signal);
  tell();
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
    ++interrupts;
    tell();
  }).detach();
}

bool interrupted() { return interrupts > 0; }

int interrupting_signal() { return first_signal; }

int interrupt_descriptor() { return event; }

}  // namespace tessera::cli
