// A drill for root: hosts in network namespaces, each with a link that is cut and healed, or slow and lossy.
//
//   TESSERA_CUTS=20 TESSERA_SLOW_SECONDS=60 TESSERA_SEED=7 build/release/bin/host_losses_drill
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/time/clock.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <utility>
#include <vector>

#include "tests/standby_cluster.h"

namespace tessera {
namespace {

using namespace tessera::testing;

constexpr double kStandstillMax_s = 4;  // two seconds until a cut is found, and what recovery takes

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

  static std::mt19937 random_from_seed() {
    const int seed = number_from("TESSERA_SEED", static_cast<int>(std::random_device()() >> 1));
    std::printf("TESSERA_SEED=%d\n", seed);
    return std::mt19937(static_cast<std::uint32_t>(seed));
  }

  void print_gaps(std::vector<double> gaps_s) const {
    if (gaps_s.empty()) return;
    std::sort(gaps_s.begin(), gaps_s.end());
    std::printf("%zu cuts, %zu pushes, %llu ticks; time without ticks: p50 %.2f s, max %.2f s\n",
                gaps_s.size(), pushes_.size(), static_cast<unsigned long long>(told_),
                gaps_s[gaps_s.size() / 2], gaps_s.back());
  }

  HostNetwork network_{kHosts};
};

TEST_F(HostLosses, CutAndHealed) {
  std::mt19937 random = random_from_seed();
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
  print_gaps(std::move(gaps_s));
}

// One way or both, between a server and another one, all others, or the coordinator that leads.
TEST_F(HostLosses, ServersCutFromEachOther) {
  std::mt19937 random = random_from_seed();
  constexpr std::size_t kServers = 3;
  std::vector<double> gaps_s;
  for (int cut = 0; cut < number_from("TESSERA_CUTS", 20); ++cut) {
    go_on(20 + random() % 60);
    if (HasFatalFailure()) return;
    const std::size_t host = kServerHosts + random() % kServers;
    std::vector<std::size_t> peers;
    for (std::size_t peer = kServerHosts; peer < kServerHosts + kServers; ++peer) {
      if (peer != host) peers.push_back(peer);
    }
    const std::uint64_t shape = random() % 4;
    if (shape == 0) peers = {kCoordinatorHosts + leader()};
    if (shape > 1) peers = {peers[random() % peers.size()]};
    const std::uint64_t ways = 1 + random() % 3;  // to the peers, from them, both
    const auto set_cut = [&](bool is_cut) {
      for (const std::size_t peer : peers) {
        if ((ways & 1) != 0) network_.cut_way(host, peer, is_cut);
        if ((ways & 2) != 0) network_.cut_way(peer, host, is_cut);
      }
    };
    const absl::Duration time = absl::Milliseconds(5000 + random() % 8000);
    longest_gap_ = absl::ZeroDuration();
    set_cut(true);
    read_for(time);
    gaps_s.push_back(absl::ToDoubleSeconds(longest_gap_));
    set_cut(false);
    std::printf("host %zu cut %s %s for %.1f s: %.2f s without ticks\n", host,
                ways == 1   ? "one way to"
                : ways == 2 ? "one way from"
                            : "from",
                absl::StrJoin(peers, ", ").c_str(), absl::ToDoubleSeconds(time), gaps_s.back());
    std::fflush(stdout);
    EXPECT_LT(gaps_s.back(), kStandstillMax_s);
    go_on(60);
  }
  expect_as_undisturbed();
  print_gaps(std::move(gaps_s));
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
