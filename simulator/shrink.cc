#include "simulator/shrink.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace tessera {
namespace {

class Search {
 public:
  Search(Shrunk start, const std::function<absl::Status(const Scenario&)>& run, int tries_max)
      : best_(std::move(start)), run_(run), tries_max_(tries_max) {}

  Shrunk run() {
    for (bool any = true; any && may_try();) {
      any = fewer_faults();
      any |= fewer_commands();
      any |= fewer_ticks();
      any |= fewer_servers();
    }
    return best_;
  }

 private:
  bool may_try() const { return !is_over_ && best_.tries < tries_max_; }

  // Whether it fails as well, and is the best from now on.
  bool try_one(const Scenario& scenario) {
    if (!may_try()) return false;
    ++best_.tries;
    absl::Status status = run_(scenario);
    if (!status.ok() && !absl::IsAborted(status)) is_over_ = true;
    if (!absl::IsAborted(status)) return false;
    best_.scenario = scenario;
    best_.failure = std::move(status);
    return true;
  }

  std::vector<std::uint32_t> chosen_faults() const {
    if (best_.scenario.only_faults) return *best_.scenario.only_faults;
    const FaultNumbers& numbers = best_.scenario.faults;
    std::vector<std::uint32_t> all(std::accumulate(numbers.begin(), numbers.end(), std::size_t{0}));
    std::iota(all.begin(), all.end(), 0u);
    return all;
  }

  // Leaves out all of them, then halves, down to single ones.
  bool fewer_faults() {
    bool any = false;
    std::vector<std::uint32_t> chosen = chosen_faults();
    for (std::size_t size = chosen.size(); size > 0; size /= 2) {
      for (std::size_t first = 0; first < chosen.size();) {
        const std::size_t last = std::min(first + size, chosen.size());
        std::vector<std::uint32_t> kept(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(first));
        kept.insert(kept.end(), chosen.begin() + static_cast<std::ptrdiff_t>(last), chosen.end());
        Scenario fewer = best_.scenario;
        fewer.only_faults = kept;
        if (try_one(fewer)) {
          any = true;
          chosen = std::move(kept);
        } else {
          first = last;
        }
      }
    }
    return any;
  }

  bool fewer_commands() {
    bool any = false;
    for (std::uint32_t less = best_.scenario.commands; less > 0; less /= 2) {
      Scenario fewer = best_.scenario;
      fewer.commands -= std::min(less, fewer.commands);
      any |= fewer.commands < best_.scenario.commands && try_one(fewer);
    }
    return any;
  }

  bool fewer_ticks() {
    bool any = false;
    for (Scenario fewer = best_.scenario; fewer.ticks > 2;) {
      fewer.ticks /= 2;
      if (!try_one(fewer)) break;
      any = true;
    }
    return any;
  }

  bool fewer_servers() {
    for (std::uint32_t servers = 1; servers < best_.scenario.servers; ++servers) {
      Scenario fewer = best_.scenario;
      fewer.servers = servers;
      if (try_one(fewer)) return true;
    }
    return false;
  }

  Shrunk best_;
  const std::function<absl::Status(const Scenario&)>& run_;
  const int tries_max_;
  bool is_over_ = false;
};

}  // namespace

Shrunk shrink(const Scenario& scenario, const absl::Status& failure,
              const std::function<absl::Status(const Scenario&)>& run, int tries_max) {
  return Search({scenario, failure, 0}, run, tries_max).run();
}

}  // namespace tessera
