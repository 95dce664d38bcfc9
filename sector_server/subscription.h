// The queue of a stream between the tick, which fills it, and the thread that sends to one client.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace tessera {

// What waits for one client, and for all of them; beyond these limits, states are left out, and events end
// their stream.
inline constexpr std::size_t kStreamBytesMax = std::size_t{64} << 20;
inline constexpr std::size_t kStreamBatchesMax = 4096;
inline constexpr std::size_t kStreamsMax = 1024;  // each has a thread
inline constexpr std::size_t kAllStreamsBytesMax = std::size_t{1} << 30;
// What a tick may take for states of bodies, in time of its thread; and for one stream at least. Others then
// get fewer.
inline constexpr std::chrono::milliseconds kPublishMax{10};
// A client that does not keep up gets one of at most so many states.
inline constexpr std::uint64_t kThinningMax = 64;
// The memory of larger batches is not kept for the next ones: other streams may need it.
inline constexpr std::size_t kKeptBytesMax = 256 << 10;
// What is on its way to a client: as it was queued, as a message, and as bytes.
inline constexpr std::size_t kCopiesOnTheWay = 3;
// A batch on its way has so long, and as much longer as it takes at the slowest rate of a connection.
inline constexpr std::chrono::seconds kPieceMax{30};
inline constexpr std::size_t kBytesPerSecondSlowest = 64 << 10;
// A client that takes nothing for so long, while its queue is full, is disconnected.
inline constexpr std::chrono::seconds kStalledMax{10};

// What a stream has told of its world.
enum class Told {
  kNothing,
  kBetweenTicks,  // how it was between two ticks: what a new stream begins with
  kOutdated,      // likewise; since then, sectors have changed servers
  kTicks,
};

template <typename Request, typename Batch>
class Subscription {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::size_t kSpareMax = 2;

  explicit Subscription(Request request) : request_(std::move(request)) {}

  const Request& request() const { return request_; }

  // An event that the client may not miss: the stream ends where there is no room for it. `bytes` is what the
  // batch takes in memory.
  void push(Batch batch, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    if (!has_room(bytes)) return overrun(Time::clock::now());
    enqueue(std::move(batch), bytes);
  }

  // Whether there is room for a state, which a later one replaces: it is left out where there is none, and
  // the client gets fewer from then on, until its queue runs empty. One that is admitted is to be pushed.
  bool admit_state(std::size_t bytes, Time now) {
    const std::lock_guard lock(mutex_);
    if (closed_) return false;
    if (!has_room(bytes)) {
      thinning_ = std::min(2 * thinning_, kThinningMax);
      if (now - last_taken_ >= kStalledMax) overrun(now);
      return false;
    }
    if (batches_.empty()) {
      thinning_ = std::max<std::uint64_t>(thinning_ / 2, 1);
      last_taken_ = now;
    }
    return true;
  }
  void push_state(Batch batch, std::size_t bytes, Time now) {
    if (admit_state(bytes, now)) push(std::move(batch), bytes);
  }
  // A state that was wanted was left out: there was no time for it.
  void leave_out() {
    const std::lock_guard lock(mutex_);
    thinning_ = std::min(2 * thinning_, kThinningMax);
  }
  // Only states of ticks that are multiples of this are wanted: a power of two, so that several servers leave
  // out the same ones.
  std::uint64_t thinning() const {
    const std::lock_guard lock(mutex_);
    return thinning_;
  }

  // What waits for the client, and what is on its way to it, in memory.
  std::size_t bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_ + kCopiesOnTheWay * bytes_on_the_way_;
  }
  // Whether the client has not read what is on its way to it in the time that it has for that.
  bool is_stuck(Time now) const {
    const std::lock_guard lock(mutex_);
    if (!on_the_way_since_) return false;
    return now - *on_the_way_since_ >=
           kPieceMax + std::chrono::seconds(bytes_on_the_way_ / kBytesPerSecondSlowest);
  }

  // Whether there may be more batches.
  bool is_open() const {
    const std::lock_guard lock(mutex_);
    return !closed_;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_one();
  }
  // Ends the stream of a client that does not take what there is for it, and frees that.
  void drop(Time now) {
    const std::lock_guard lock(mutex_);
    overrun(now);
  }
  // Since when the stream has ended for that reason.
  std::optional<Time> overrun_since() const {
    const std::lock_guard lock(mutex_);
    return overrun_since_;
  }

  // The next batch; nothing once the subscription is closed, or `patience` has passed (then alive() tells).
  std::optional<Batch> next(std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, patience, [&] { return closed_ || !batches_.empty(); });
    if (batches_.empty()) return std::nullopt;
    Batch batch = std::move(batches_.front().batch);
    bytes_ -= batches_.front().bytes;
    bytes_on_the_way_ = batches_.front().bytes;
    batches_.pop_front();
    last_taken_ = Time::clock::now();
    on_the_way_since_ = last_taken_;
    return batch;
  }
  // Returns a batch of next(), which has been sent; its memory is reused, unless that is large.
  void take_back(Batch batch) {
    const std::lock_guard lock(mutex_);
    const bool is_large = bytes_on_the_way_ > kKeptBytesMax;
    bytes_on_the_way_ = 0;
    on_the_way_since_.reset();
    if (!is_large && spare_.size() < kSpareMax) spare_.push_back(std::move(batch));
  }
  // Such a batch, with its old contents, or else an empty one.
  Batch spare() {
    const std::lock_guard lock(mutex_);
    if (spare_.empty()) return {};
    Batch batch = std::move(spare_.back());
    spare_.pop_back();
    return batch;
  }
  bool alive() const {
    const std::lock_guard lock(mutex_);
    return !closed_ || !batches_.empty();
  }

  // Owned by the list that holds it.
  Told told_of_world = Told::kNothing;
  // Whether it is shown how the world is between two ticks.
  bool is_new() const { return told_of_world == Told::kNothing || told_of_world == Told::kOutdated; }
  std::optional<Time> unclaimed_since;  // it waits for the client that has it at other servers
  std::function<void()> cancel;         // ends the call, even while it waits for its client; may be empty

 private:
  struct Queued {
    Batch batch;
    std::size_t bytes;
  };

  // One batch may be of any size.
  bool has_room(std::size_t bytes) const {
    return batches_.empty() || (batches_.size() < kStreamBatchesMax && bytes_ + bytes <= kStreamBytesMax);
  }
  void overrun(Time now) {
    overrun_since_ = now;
    closed_ = true;
    batches_.clear();
    bytes_ = 0;
    changed_.notify_one();
  }
  void enqueue(Batch batch, std::size_t bytes) {
    batches_.push_back({std::move(batch), bytes});
    bytes_ += bytes;
    changed_.notify_one();
  }

  const Request request_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Queued> batches_;
  std::size_t bytes_ = 0;             // of the batches
  std::size_t bytes_on_the_way_ = 0;  // of the last one from next(), until it is taken back
  std::optional<Time> on_the_way_since_;
  std::vector<Batch> spare_;
  std::uint64_t thinning_ = 1;
  Time last_taken_ = Time::clock::now();
  bool closed_ = false;
  std::optional<Time> overrun_since_;
};

}  // namespace tessera
