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

inline void join(BodyFrame& whole, BodyFrame part) {
  join(whole.bodies, std::move(part.bodies), [](const auto& a, const auto& b) { return a.id < b.id; });
}

inline void join(ContactFrame& whole, ContactFrame part) {
  join(whole.contacts, std::move(part.contacts), [](const auto& x, const auto& y) {
    return std::tie(x.a, x.b, x.phase) < std::tie(y.a, y.b, y.phase);
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

// Where a part of a tick comes from: see StreamSource in tessera.proto.
struct PartOrigin {
  std::uint64_t load = 0;
  std::uint64_t epoch = 0;
  std::size_t servers = 1;
  std::uint64_t node = 0;
};

// Servers push their parts of ticks, ascending within an epoch; one reader gets whole ticks, each once, in
// their order. Safe to use from any thread.
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
    const auto has_room = [&] { return sources_[origin.node].parts.size() < kFramesQueuedMax; };
    changed_.wait(lock, [&] { return end_ || origin.epoch < epoch_ || has_room(); });
    if (end_) return false;
    if (origin.epoch < epoch_) return true;
    Source& from = sources_[origin.node];
    const bool is_new =
        part.tick > std::max(from.last.value_or(0), merged_.value_or(0)) || (!from.last && !merged_);
    from.last = std::max(part.tick, from.last.value_or(0));
    if (is_new) from.parts.push_back({std::move(part), is_whole});
    changed_.notify_all();
    return true;
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
    std::optional<Tick> last;
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
    return epoch_ > 0 && sources_.size() >= servers_ &&
           std::all_of(sources_.begin(), sources_.end(),
                       [](const auto& source) { return source.second.last.has_value(); });
  }

  // The world was set back: what the servers have told of ticks that are not whole will come again.
  void begin_epoch(const PartOrigin& origin) {
    while (std::optional<Frame> frame = take_merged()) ready_.push_back(*std::move(frame));
    if (ready_.size() > kReadyMax) finish(absl::ResourceExhaustedError("the reader is too far behind"));
    sources_.clear();
    epoch_ = origin.epoch;
    servers_ = origin.servers;
    changed_.notify_all();
  }

  std::optional<Frame> take() {
    if (ready_.empty()) return take_merged();
    std::optional<Frame> frame = std::move(ready_.front());
    ready_.pop_front();
    return frame;
  }

  // The earliest tick that all servers have; earlier ticks that only some have are dropped.
  std::optional<Frame> take_merged() {
    for (;;) {
      if (!all_have_told()) return std::nullopt;
      Tick tick = 0;
      for (const auto& [node, source] : sources_) {
        if (source.parts.empty()) return std::nullopt;
        tick = std::max(tick, source.parts.front().frame.tick);
      }
      bool equal = true;
      for (auto& [node, source] : sources_) {
        while (!source.parts.empty() && source.parts.front().frame.tick < tick) {
          source.parts.pop_front();
          ++skipped_;
          changed_.notify_all();
        }
        equal = equal && !source.parts.empty() && source.parts.front().frame.tick == tick;
      }
      if (equal) return merge(tick);
    }
  }

  Frame merge(Tick tick) {
    Frame whole;
    bool is_whole = true;
    for (auto& [node, source] : sources_) {
      is_whole = is_whole && source.parts.front().is_whole;
      join(whole, std::move(source.parts.front().frame));
      source.parts.pop_front();
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
  std::size_t servers_ = 0;
  std::map<std::uint64_t, Source> sources_;  // of this epoch, by node
  std::deque<Frame> ready_;                  // of earlier epochs
  std::optional<Tick> merged_;               // the last tick that was whole
  std::optional<absl::Status> end_;
  std::uint64_t skipped_ = 0;
};

}  // namespace tessera
