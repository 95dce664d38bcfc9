// How long a sector server works on its ticks, and how long it waits for others.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "lpss/tick/messages.h"

namespace tessera {

class TickMeter {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  // A change of the map counts with the tick that follows.
  void begin_move(Nanoseconds now) {
    began_ = now;
    own_ = {};
  }
  void end_move(Nanoseconds now) {
    move_ += now - began_;
    move_own_ += own_;
  }

  // `ground_waits`: of the process, for tiles of ground, so far.
  void begin_tick(Nanoseconds now, std::uint64_t ground_waits) {
    began_ = now - std::exchange(move_, {});
    own_ = std::exchange(move_own_, {});
    ground_waits_ = ground_waits;
  }
  // Work on the tick or the change of the map, without waiting.
  void add_own(Nanoseconds time) { own_ += time; }

  struct Times {
    Nanoseconds all{};
    Nanoseconds own{};
  };
  Times end_tick(Nanoseconds now, std::uint64_t ground_waits) {
    const Times times{now - began_, own_};
    const auto ticks = static_cast<double>(std::min(++ticks_, kUsualTicks));
    usual_own_us_ += (in_us(times.own) - usual_own_us_) / ticks;
    usual_wait_us_ += (in_us(times.all - times.own) - usual_wait_us_) / ticks;
    if (ground_waits != ground_waits_) ++ticks_waited_for_ground_;
    return times;
  }

  // Of the last ticks, mean.
  double usual_own_us() const { return usual_own_us_; }
  double usual_wait_us() const { return std::max(usual_wait_us_, 0.0); }
  std::uint64_t ticks_waited_for_ground() const { return ticks_waited_for_ground_; }

 private:
  static constexpr Tick kUsualTicks = 64;  // that a mean of the last ones looks back

  static double in_us(Nanoseconds time) { return std::chrono::duration<double, std::micro>(time).count(); }

  Nanoseconds began_{};
  Nanoseconds own_{};
  Nanoseconds move_{};  // that the change of the map before the next tick took
  Nanoseconds move_own_{};
  double usual_own_us_ = 0;
  double usual_wait_us_ = 0;
  Tick ticks_ = 0;
  std::uint64_t ground_waits_ = 0;  // as the tick began
  std::uint64_t ticks_waited_for_ground_ = 0;
};

}  // namespace tessera
