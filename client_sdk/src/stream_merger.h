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

// Sources push their parts of ticks, ascending; one reader gets whole ticks. Safe to use from any thread.
template <typename Frame>
class StreamMerger {
 public:
  explicit StreamMerger(std::size_t sources) : sources_(sources) {}

  // Waits while the source is kFramesQueuedMax ahead of the reader. `is_whole` is false if the source does
  // not have the complete tick: then the frame is empty. False once the stream has ended.
  bool push(std::size_t source, Frame part, bool is_whole = true) {
    std::unique_lock lock(mutex_);
    Source& from = sources_[source];
    if (from.last && part.tick <= *from.last) {
      finish(absl::AbortedError("the world was unloaded or replaced"));
    }
    changed_.wait(lock, [&] { return end_ || from.parts.size() < kFramesQueuedMax; });
    if (end_) return false;
    from.last = part.tick;
    from.parts.push_back({std::move(part), is_whole});
    changed_.notify_all();
    return true;
  }

  // Only the first end counts. Whole ticks that have arrived can still be read.
  void end(absl::Status status) {
    const std::lock_guard lock(mutex_);
    finish(std::move(status));
  }

  // Waits until every source has pushed something. Errors as next().
  absl::Status wait_for_all(absl::Duration timeout) {
    std::unique_lock lock(mutex_);
    const auto all = [&] {
      return std::all_of(sources_.begin(), sources_.end(),
                         [](const Source& s) { return s.last.has_value(); });
    };
    if (!wait(lock, timeout, [&] { return end_ || all(); })) {
      return absl::DeadlineExceededError("not every server has answered to the subscription in time");
    }
    return all() ? absl::OkStatus() : *end_;
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

 private:
  struct Part {
    Frame frame;
    bool is_whole;
  };
  struct Source {
    std::deque<Part> parts;
    std::optional<Tick> last;
  };

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

  // The earliest tick that all sources have; earlier ticks that only some have are dropped.
  std::optional<Frame> take() {
    for (;;) {
      Tick tick = 0;
      for (const Source& source : sources_) {
        if (source.parts.empty()) return std::nullopt;
        tick = std::max(tick, source.parts.front().frame.tick);
      }
      bool equal = true;
      for (Source& source : sources_) {
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
    for (Source& source : sources_) {
      is_whole = is_whole && source.parts.front().is_whole;
      join(whole, std::move(source.parts.front().frame));
      source.parts.pop_front();
    }
    changed_.notify_all();
    if (!is_whole) whole = Frame();
    whole.tick = tick;
    return whole;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Source> sources_;
  std::optional<absl::Status> end_;
  std::uint64_t skipped_ = 0;
};

}  // namespace tessera
