// Round trip and throughput of DdsLink between two processes on this host:
//   dds_link_benchmark [payload bytes = 16384] [round trips = 20000] [megabytes one way = 1000] [network]
// "network": without shared memory.
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "transport/dds_link.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

constexpr NodeId kNear{2};
constexpr NodeId kFar{3};
// Bytes in transit in the throughput run, limited so that the producer does not outrun the consumer.
constexpr std::size_t kAheadBytes = 8 << 20;

struct Plan {
  std::size_t bytes = 16384;
  int round_trips = 20000;
  std::size_t megabytes = 1000;
  bool shared_memory = true;

  std::size_t bulk_messages() const { return megabytes * 1'000'000 / bytes; }
};

std::unique_ptr<DdsLink> open(NodeId self, std::uint32_t domain, bool shared_memory) {
  auto link = DdsLink::create(
      {.domain = domain, .cluster = "benchmark", .network = {.shared_memory = shared_memory}, .self = self});
  if (!link.ok()) {
    std::fprintf(stderr, "%s\n", link.status().ToString().c_str());
    std::exit(1);
  }
  return *std::move(link);
}

// The next messages, at least one.
std::vector<Delivery> next(DdsLink& link) {
  for (;;) {
    std::vector<Delivery> result =
        link.receive(Clock::now() + std::chrono::seconds(20), std::chrono::microseconds(200));
    if (!result.empty()) return result;
  }
}

// Echoes the round trips, then counts the bulk data and reports progress and completion.
void run_far(const Plan& plan, std::uint32_t domain) {
  auto link = open(kFar, domain, plan.shared_memory);
  int left = plan.round_trips + 1;
  std::size_t bulk = 0;
  std::size_t unreported = 0;
  while (bulk < plan.bulk_messages()) {
    for (Delivery& delivery : next(*link)) {
      if (left > 0) {
        --left;
        link->send(delivery.from, std::move(delivery.payload));
        continue;
      }
      ++bulk;
      unreported += delivery.payload.size();
      if (unreported >= kAheadBytes / 4 || bulk == plan.bulk_messages()) {
        link->send(delivery.from, std::to_string(bulk));
        unreported = 0;
      }
    }
  }
  // Waits until the other process knows that everything has arrived.
  next(*link);
}

void run_near(const Plan& plan, std::uint32_t domain) {
  auto link = open(kNear, domain, plan.shared_memory);
  const std::string payload(plan.bytes, 'x');
  link->send(kFar, payload);
  next(*link);
  std::vector<double> times_us;
  for (int i = 0; i < plan.round_trips; ++i) {
    const auto begin = Clock::now();
    link->send(kFar, payload);
    next(*link);
    times_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }
  std::sort(times_us.begin(), times_us.end());
  const auto quantile = [&](double q) {
    return times_us[static_cast<std::size_t>(q * (times_us.size() - 1))];
  };
  std::printf("round trip of %zu bytes, us: best %.1f, median %.1f, 90 %% %.1f, 99 %% %.1f, worst %.1f\n",
              plan.bytes, quantile(0), quantile(0.5), quantile(0.9), quantile(0.99), quantile(1));

  const auto begin = Clock::now();
  std::size_t arrived = 0;
  std::size_t sent = 0;
  while (arrived < plan.bulk_messages()) {
    while (sent < plan.bulk_messages() && (sent - arrived) * plan.bytes < kAheadBytes) {
      link->send(kFar, payload);
      ++sent;
    }
    for (const Delivery& delivery : next(*link)) arrived = std::stoull(delivery.payload);
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  std::printf("one way, %zu messages of %zu bytes: %.2f Gbit/s, %.0f messages/s\n", sent, plan.bytes,
              static_cast<double>(sent * plan.bytes) * 8e-9 / seconds, static_cast<double>(sent) / seconds);
  link->send(kFar, "done");
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  tessera::Plan plan;
  if (argc > 1) plan.bytes = std::strtoull(argv[1], nullptr, 10);
  if (argc > 2) plan.round_trips = std::atoi(argv[2]);
  if (argc > 3) plan.megabytes = std::strtoull(argv[3], nullptr, 10);
  if (argc > 4) plan.shared_memory = std::strcmp(argv[4], "network") != 0;
  // As in the daemons: keep freed memory in the process.
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  const auto domain = static_cast<std::uint32_t>(getpid() % 100);
  const pid_t child = fork();
  if (child == 0) {
    tessera::run_far(plan, domain);
    return 0;
  }
  tessera::run_near(plan, domain);
  int status = 0;
  waitpid(child, &status, 0);
  return status == 0 ? 0 : 1;
}
