// A stream of the cluster of which only the newest frame counts: a slow reader misses frames and never gets
// old ones. Frames that tell only what has changed are merged.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "tessera/stream.h"

namespace tessera::live {

template <typename Frame>
class LatestFrame {
 public:
  using Open = std::function<absl::StatusOr<std::unique_ptr<Stream<Frame>>>()>;

  // Adds a frame to those that nobody has taken yet.
  using Merge = std::function<void(Frame& kept, Frame next)>;

  // `on_change` is called, on a thread of its own, when there is a new frame. Without `merge`, a frame
  // replaces the one before.
  explicit LatestFrame(std::function<void()> on_change, Merge merge = nullptr)
      : on_change_(std::move(on_change)), merge_(std::move(merge)), thread_([this] { run(); }) {}

  ~LatestFrame() {
    {
      const std::lock_guard lock(mutex_);
      closing_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  // Replaces the watched stream by the one that `open` opens. If it ends or cannot be opened, opens it again
  // after a while. With an empty function, watches nothing.
  void watch(Open open) {
    {
      const std::lock_guard lock(mutex_);
      open_ = std::move(open);
      ++wanted_;
      if (!open_) latest_.reset();
    }
    changed_.notify_all();
  }

  // The newest frame, once.
  std::optional<Frame> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(latest_, std::nullopt);
  }

  bool has_frame() const {
    const std::lock_guard lock(mutex_);
    return latest_.has_value();
  }

 private:
  static constexpr absl::Duration kPatience = absl::Milliseconds(50);  // so that watch() takes effect soon
  static constexpr std::chrono::milliseconds kRetryAfter{500};

  void run() {
    std::unique_ptr<Stream<Frame>> stream;
    std::uint64_t opened = 0;
    std::unique_lock lock(mutex_);
    while (!closing_) {
      if (opened != wanted_) {
        opened = wanted_;
        const Open open = open_;
        lock.unlock();
        // The old stream continues until the new one is open.
        auto next = open ? open() : nullptr;
        stream = next.ok() ? *std::move(next) : nullptr;
        lock.lock();
        if (!stream && open && opened == wanted_) {
          changed_.wait_for(lock, kRetryAfter, [&] { return closing_ || opened != wanted_; });
          if (opened == wanted_) opened = wanted_ - 1;
        }
      } else if (!stream) {
        changed_.wait(lock, [&] { return closing_ || opened != wanted_; });
      } else {
        lock.unlock();
        absl::StatusOr<Frame> frame = stream->next(kPatience);
        lock.lock();
        if (frame.ok()) {
          if (merge_ && latest_) {
            merge_(*latest_, *std::move(frame));
          } else {
            latest_ = *std::move(frame);
          }
          lock.unlock();
          on_change_();
          lock.lock();
        } else if (frame.status().code() != absl::StatusCode::kDeadlineExceeded) {
          stream = nullptr;
          opened = wanted_ - 1;
        }
      }
    }
  }

  const std::function<void()> on_change_;
  const Merge merge_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Open open_;
  std::uint64_t wanted_ = 0;
  std::optional<Frame> latest_;
  bool closing_ = false;
  std::thread thread_;
};

}  // namespace tessera::live
