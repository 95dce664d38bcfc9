// Merges the parts of ticks that several servers stream.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/time/time.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tessera/stream.h"

namespace tessera {

// Merges the sorted parts of several servers into one sorted list.
template <typename Sample, typename Order>
void join(std::vector<Sample>& whole, std::vector<Sample> part, const Order& order) {
  if (whole.empty()) {
    whole = std::move(part);
    return;
  }
  std::vector<Sample> both;
  both.reserve(whole.size() + part.size());
  std::merge(std::move_iterator(whole.begin()), std::move_iterator(whole.end()),
             std::move_iterator(part.begin()), std::move_iterator(part.end()), std::back_inserter(both),
             order);
  whole = std::move(both);
}

inline void join(ContactFrame& whole, ContactFrame part) {
  join(whole.contacts, std::move(part.contacts), [](const auto& x, const auto& y) {
    return std::tie(x.trigger, x.a, x.b, x.phase) < std::tie(y.trigger, y.a, y.b, y.phase);
  });
}

inline void join(DivergenceFrame& whole, DivergenceFrame part) {
  join(whole.divergences, std::move(part.divergences), std::less());
}

// Merges the parts of an island.
inline void join(SeamFrame& whole, SeamFrame part) {
  join(whole.clones, std::move(part.clones), [](const auto& a, const auto& b) {
    return std::pair(a.body, a.sector) < std::pair(b.body, b.sector);
  });
  join(whole.islands, std::move(part.islands), [](const auto& a, const auto& b) { return a.id < b.id; });
  std::vector<IslandSample> parts = std::exchange(whole.islands, {});
  for (IslandSample& island : parts) {
    if (whole.islands.empty() || whole.islands.back().id != island.id) {
      whole.islands.push_back(std::move(island));
    } else {
      join(whole.islands.back().bodies, std::move(island.bodies), std::less());
    }
  }
}

// Of a program that has changed servers, and is told twice since parts were left out, the later sample
// counts.
inline void join(ProgramFrame& whole, ProgramFrame part) {
  const auto place = [](const ProgramSample& of) { return std::pair(of.body, of.program); };
  join(whole.programs, std::move(part.programs), [&](const auto& x, const auto& y) {
    return std::pair(place(x), y.tick) < std::pair(place(y), x.tick);
  });
  const auto again = std::ranges::unique(whole.programs, {}, place);
  whole.programs.erase(again.begin(), again.end());
}

// Of one server: `later` becomes what it would have told, had it not told `earlier`.
inline void carry_over(ProgramFrame& later, ProgramFrame earlier) { join(later, std::move(earlier)); }

// Where a part of a tick comes from: see StreamSource in tessera.proto.
struct PartOrigin {
  std::uint64_t load = 0;
  std::uint64_t epoch = 0;
  std::size_t servers = 1;
  std::uint64_t node = 0;
  Tick since = 0;
};

// Servers push their parts of ticks, ascending within an epoch; one reader gets whole ticks, each once, in
// their order. Where servers join and leave, a tick is whole once those have told of it that take part in it.
// Where a frame tells of changes (it has carry_over()), those of parts that are left out go into the server's
// next part. Safe to use from any thread.
template <typename Frame>
class StreamMerger {
 public:
  // Waits while the server is kFramesQueuedMax ahead of the reader. `is_whole` is false if it does not have
  // the complete tick: then the frame is empty. False once the stream has ended.
  bool push(const PartOrigin& origin, Frame part, bool is_whole = true) {
    std::unique_lock lock(mutex_);
    if (load_.value_or(origin.load) != origin.load) {
      finish(absl::AbortedError("the world was unloaded or replaced"));
    }
    load_ = origin.load;
    if (origin.epoch > epoch_) begin_epoch(origin);
    const auto has_room = [&] { return queued(origin.node) < kFramesQueuedMax; };
    changed_.wait(lock, [&] { return end_ || origin.epoch < epoch_ || has_room(); });
    if (end_) return false;
    if (origin.epoch < epoch_) return true;
    if (origin.since < earliest_) {
      leave_out(origin.node, std::move(part));
      return true;
    }
    ended_.erase(origin.node);
    Period& period = periods_[origin.since];
    period.servers = origin.servers;
    Source& from = period.sources[origin.node];
    std::optional<Told>& last = last_[origin.node];
    const Told told{part.tick, origin.since};
    const bool is_later = !last || told.is_after(*last);
    const bool is_new = is_later && (!merged_ || part.tick > *merged_);
    if (is_later) last = told;
    if (is_new) {
      from.parts.push_back({std::move(part), is_whole});
    } else {
      leave_out(origin.node, std::move(part));
    }
    changed_.notify_all();
    return true;
  }

  // Nothing more comes from that server, unless it begins anew.
  void ended(std::uint64_t node) {
    const std::lock_guard lock(mutex_);
    ended_.insert(node);
    changed_.notify_all();
  }

  // Only the first end counts. Whole ticks that have arrived can still be read.
  void end(absl::Status status) {
    const std::lock_guard lock(mutex_);
    finish(std::move(status));
  }
  bool has_ended() const {
    const std::lock_guard lock(mutex_);
    return end_.has_value();
  }

  // Waits until every server of the world has pushed something. Errors as next().
  absl::Status wait_for_all(absl::Duration timeout) {
    std::unique_lock lock(mutex_);
    if (!wait(lock, timeout, [&] { return end_ || all_have_told(); })) {
      return absl::DeadlineExceededError("not every server has answered to the subscription in time");
    }
    return all_have_told() ? absl::OkStatus() : *end_;
  }

  absl::StatusOr<Frame> next(absl::Duration timeout) {
    std::unique_lock lock(mutex_);
    std::optional<Frame> frame;
    const bool in_time = wait(lock, timeout, [&] {
      frame = take();
      return frame.has_value() || end_.has_value();
    });
    if (frame) return *std::move(frame);
    return in_time ? *end_ : absl::DeadlineExceededError("no tick was complete in time");
  }

  std::uint64_t skipped() const {
    const std::lock_guard lock(mutex_);
    return skipped_;
  }
  // Of the world; nothing before the first part.
  std::optional<std::uint64_t> load() const {
    const std::lock_guard lock(mutex_);
    return load_;
  }
  std::uint64_t epoch() const {
    const std::lock_guard lock(mutex_);
    return epoch_;
  }

 private:
  struct Part {
    Frame frame;
    bool is_whole;
  };
  struct Source {
    std::deque<Part> parts;
  };
  // Ticks of the same servers.
  struct Period {
    std::size_t servers = 0;
    std::map<std::uint64_t, Source> sources;  // that have told something, by node

    bool all_have_told() const { return sources.size() >= servers; }
  };
  using Periods = std::map<Tick, Period>;
  // What a server has told last. Between two ticks it may tell of a tick again, in a later period.
  struct Told {
    Tick tick = 0;
    Tick since = 0;

    bool is_after(const Told& other) const { return tick > other.tick || since > other.since; }
  };

  static constexpr std::size_t kReadyMax = 16 * kFramesQueuedMax;

  template <typename Condition>
  bool wait(std::unique_lock<std::mutex>& lock, absl::Duration timeout, Condition condition) {
    if (timeout == absl::InfiniteDuration()) {
      changed_.wait(lock, condition);
      return true;
    }
    return changed_.wait_until(lock, std::chrono::steady_clock::now() + absl::ToChronoNanoseconds(timeout),
                               condition);
  }

  void finish(absl::Status status) {
    if (!end_) end_ = std::move(status);
    changed_.notify_all();
  }

  bool all_have_told() const {
    return std::any_of(periods_.begin(), periods_.end(),
                       [](const auto& period) { return period.second.all_have_told(); });
  }

  std::size_t queued(std::uint64_t node) const {
    std::size_t parts = 0;
    for (const auto& [since, period] : periods_) {
      const auto source = period.sources.find(node);
      if (source != period.sources.end()) parts += source->second.parts.size();
    }
    return parts;
  }

  // The world was set back: what the servers have told of ticks that are not whole will come again.
  void begin_epoch(const PartOrigin& origin) {
    while (std::optional<Frame> frame = take_merged()) ready_.push_back(*std::move(frame));
    if (ready_.size() > kReadyMax) finish(absl::ResourceExhaustedError("the reader is too far behind"));
    periods_.clear();
    left_out_.clear();
    last_.clear();
    ended_.clear();
    earliest_ = 0;
    epoch_ = origin.epoch;
    changed_.notify_all();
  }

  std::optional<Frame> take() {
    if (ready_.empty()) return take_merged();
    std::optional<Frame> frame = std::move(ready_.front());
    ready_.pop_front();
    return frame;
  }

  std::optional<Frame> take_merged() {
    while (!periods_.empty()) {
      const auto first = periods_.begin();
      if (std::optional<Frame> frame = take_merged(first->first, first->second)) return frame;
      if (!is_over(first)) return std::nullopt;
      for (auto& [node, source] : first->second.sources) drop_before(node, source, first->first, UINT64_MAX);
      periods_.erase(first);
      earliest_ = periods_.begin()->first;
    }
    return std::nullopt;
  }

  // Whether nothing more comes of its ticks: those of its servers that stay tell of later ones, and the
  // others have ended. A later period may have been over before a server that joined in it could tell.
  bool is_over(typename Periods::const_iterator period) const {
    const auto next = std::next(period);
    const auto all_have_told = [](const auto& later) { return later.second.all_have_told(); };
    if (std::none_of(next, periods_.end(), all_have_told)) return false;
    return std::all_of(period->second.sources.begin(), period->second.sources.end(), [&](const auto& source) {
      return ended_.contains(source.first) || std::any_of(next, periods_.end(), [&](const auto& later) {
               return later.second.sources.contains(source.first);
             });
    });
  }

  void leave_out(std::uint64_t node, Frame part) {
    if constexpr (requires { carry_over(part, Frame()); }) {
      const auto [place, is_first] = left_out_.try_emplace(node, std::move(part));
      if (is_first) return;
      carry_over(part, std::move(place->second));
      place->second = std::move(part);
    }
  }
  // The next part of a server, with what was left out before it.
  Frame take_part(std::uint64_t node, Source& source) {
    Frame part = std::move(source.parts.front().frame);
    source.parts.pop_front();
    if constexpr (requires { carry_over(part, Frame()); }) {
      if (auto left = left_out_.extract(node)) carry_over(part, std::move(left.mapped()));
    }
    return part;
  }

  // What a server that joined told of the tick before is not missed.
  void drop_before(std::uint64_t node, Source& source, Tick since, Tick tick) {
    while (!source.parts.empty() && source.parts.front().frame.tick < tick) {
      if (source.parts.front().frame.tick >= since) ++skipped_;
      leave_out(node, std::move(source.parts.front().frame));
      source.parts.pop_front();
      changed_.notify_all();
    }
  }

  // The earliest tick that all servers have; earlier ticks that only some have are dropped.
  std::optional<Frame> take_merged(Tick since, Period& period) {
    for (;;) {
      if (!period.all_have_told()) return std::nullopt;
      Tick tick = 0;
      for (const auto& [node, source] : period.sources) {
        if (source.parts.empty()) return std::nullopt;
        tick = std::max(tick, source.parts.front().frame.tick);
      }
      bool equal = true;
      for (auto& [node, source] : period.sources) {
        drop_before(node, source, since, tick);
        equal = equal && !source.parts.empty() && source.parts.front().frame.tick == tick;
      }
      if (equal) return merge(tick, period);
    }
  }

  Frame merge(Tick tick, Period& period) {
    Frame whole;
    bool is_whole = true;
    for (auto& [node, source] : period.sources) {
      is_whole = is_whole && source.parts.front().is_whole;
      join(whole, take_part(node, source));
    }
    changed_.notify_all();
    if (!is_whole) whole = Frame();
    if (!is_whole && merged_) ++skipped_;
    whole.tick = tick;
    merged_ = tick;
    return whole;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::uint64_t> load_;
  std::uint64_t epoch_ = 0;
  // Of this epoch: by their first ticks, what servers have told last, and those that have ended.
  Periods periods_;
  std::map<std::uint64_t, std::optional<Told>> last_;
  std::map<std::uint64_t, Frame> left_out_;  // by node, of parts that were not merged
  std::set<std::uint64_t> ended_;
  Tick earliest_ = 0;           // of the periods that may still come
  std::deque<Frame> ready_;     // of earlier epochs
  std::optional<Tick> merged_;  // the last tick that was whole
  std::optional<absl::Status> end_;
  std::uint64_t skipped_ = 0;
};

}  // namespace tessera
