// A drill for root: hosts in network namespaces, each with a link that is cut and healed, or slow and lossy.
//
//   TESSERA_CUTS=20 TESSERA_SLOW_SECONDS=60 TESSERA_SEED=7 build/release/bin/host_losses_drill
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/time/clock.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "tests/standby_cluster.h"

namespace tessera {
namespace {

using namespace tessera::testing;

// Of a variable of the environment.
int number_from(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  int number = otherwise;
  return text != nullptr && absl::SimpleAtoi(text, &number) ? number : otherwise;
}

class HostLosses : public StandbyCluster {
 protected:
  void SetUp() override { start_all(&network_); }

  // A client that has not been answered does not know whether a push has taken effect, so none is under way
  // when a link is cut. While it is, the client only reads.
  void read_for(absl::Duration time) {
    const absl::Time end = absl::Now() + time;
    while (absl::Now() < end && !HasFatalFailure()) read_what_is_there(end);
  }

  HostNetwork network_{kHosts};
};

TEST_F(HostLosses, CutAndHealed) {
  const int seed = number_from("TESSERA_SEED", static_cast<int>(std::random_device()() >> 1));
  std::printf("TESSERA_SEED=%d\n", seed);
  std::mt19937 random(static_cast<std::uint32_t>(seed));
  std::vector<double> gaps_s;
  for (int cut = 0; cut < number_from("TESSERA_CUTS", 20); ++cut) {
    go_on(20 + random() % 60);
    if (HasFatalFailure()) return;
    const std::size_t host = random() % kClientHost;
    const absl::Duration time = absl::Milliseconds(300 + random() % 6000);
    longest_gap_ = absl::ZeroDuration();
    network_.cut(host, true);
    read_for(time);
    network_.cut(host, false);
    go_on(60);
    gaps_s.push_back(absl::ToDoubleSeconds(longest_gap_));
    std::printf("host %zu cut for %.1f s: %.2f s without ticks; coordinator %zu leads\n", host,
                absl::ToDoubleSeconds(time), gaps_s.back(), leader());
    std::fflush(stdout);
  }
  expect_as_undisturbed();
  std::sort(gaps_s.begin(), gaps_s.end());
  if (!gaps_s.empty())
    std::printf("%zu cuts, %zu pushes, %llu ticks; time without ticks: p50 %.2f s, max %.2f s\n",
                gaps_s.size(), pushes_.size(), static_cast<unsigned long long>(told_),
                gaps_s[gaps_s.size() / 2], gaps_s.back());
}

TEST_F(HostLosses, SlowAndLossy) {
  go_on(60);
  network_.disturb(std::chrono::milliseconds(50), 10);
  const Tick before = told_;
  const absl::Time end = absl::Now() + absl::Seconds(number_from("TESSERA_SLOW_SECONDS", 60));
  while (absl::Now() < end && !HasFatalFailure()) go_on(10);
  std::printf("%llu ticks with 50 ms and 1 %% loss\n", static_cast<unsigned long long>(told_ - before));
  network_.disturb(std::chrono::milliseconds(0), 0);
  go_on(60);
  expect_as_undisturbed();
}

}  // namespace
}  // namespace tessera
