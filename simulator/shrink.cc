#include "simulator/shrink.h"

#include <algorithm>
#include <numeric>
#include <optional>
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

  using Places = std::vector<std::uint32_t>;

  static Places all_places(std::size_t count) {
    Places all(count);
    std::iota(all.begin(), all.end(), 0u);
    return all;
  }

  Places chosen_faults() const {
    if (best_.scenario.only_faults) return *best_.scenario.only_faults;
    const FaultNumbers& numbers = best_.scenario.faults;
    return all_places(std::accumulate(numbers.begin(), numbers.end(), std::size_t{0}));
  }

  Places chosen_commands() const {
    if (!best_.scenario.only_commands) return all_places(best_.scenario.commands);
    Places chosen = *best_.scenario.only_commands;
    std::erase_if(chosen, [this](std::uint32_t place) { return place >= best_.scenario.commands; });
    return chosen;
  }

  // Leaves out all of them, then halves, down to single ones.
  bool fewer(Places chosen, std::optional<Places> Scenario::*only) {
    bool any = false;
    for (std::size_t size = chosen.size(); size > 0; size /= 2) {
      for (std::size_t first = 0; first < chosen.size() && may_try();) {
        const std::size_t last = std::min(first + size, chosen.size());
        Places kept(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(first));
        kept.insert(kept.end(), chosen.begin() + static_cast<std::ptrdiff_t>(last), chosen.end());
        Scenario smaller = best_.scenario;
        smaller.*only = kept;
        if (try_one(smaller)) {
          any = true;
          chosen = std::move(kept);
        } else {
          first = last;
        }
      }
    }
    return any;
  }

  bool fewer_faults() { return fewer(chosen_faults(), &Scenario::only_faults); }

  // Those at the end go first; what is left of them is what a failure needs.
  bool fewer_commands() {
    bool any = false;
    for (std::uint32_t less = best_.scenario.commands; less > 0; less /= 2) {
      Scenario fewer = best_.scenario;
      fewer.commands -= std::min(less, fewer.commands);
      any |= fewer.commands < best_.scenario.commands && try_one(fewer);
    }
    return fewer(chosen_commands(), &Scenario::only_commands) || any;
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
