#include "coordinator/pace_log.h"

#include <algorithm>
#include <cmath>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

// At first those of half a second, of which half are done when the next ones are stored; of a world that is
// faster than real time so many that the store is not written much more often.
constexpr double kAheadSeconds = 0.5;
constexpr std::uint64_t kAheadAtFirstMax = 256;
constexpr std::uint64_t kAheadMax = 16'384;
constexpr std::chrono::milliseconds kPaceStoredEvery{250};

bool is_same_pace(const v1::StoredPace& a, const v1::StoredPace& b) {
  return a.mode() == b.mode() && a.target() == b.target() && a.real_time_factor() == b.real_time_factor();
}

}  // namespace

bool PaceLog::is_known(const v1::StoredPace& next, const Sequencer& sequencer) const {
  if (next.mode() == v1::StoredPace::PAUSED) {
    // A step that is done pauses by itself.
    const bool pauses = last_->mode() != v1::StoredPace::RUNNING && last_->certain() >= last_->target();
    return pauses && next.certain() == last_->certain();
  }
  return is_same_pace(next, *last_) &&
         (sequencer.certain() + ahead_ / 2 <= last_->certain() || next.certain() == last_->certain());
}

std::optional<v1::StoredPace> PaceLog::next(const Sequencer& sequencer, Nanoseconds now) {
  const double ticks = std::ceil(kAheadSeconds / sequencer.time_step());
  const auto at_first = static_cast<std::uint64_t>(std::min<double>(ticks, kAheadAtFirstMax));
  ahead_ = std::max(ahead_, at_first);
  if (last_) {
    const v1::StoredPace pace = sequencer.stored_pace(ahead_);
    if (is_known(pace, sequencer)) return std::nullopt;
    if (!is_same_pace(pace, *last_)) {
      ahead_ = at_first;
    } else if (now < time_ + kPaceStoredEvery / 2) {
      ahead_ = std::min(2 * ahead_, kAheadMax);
    } else if (now > time_ + 2 * kPaceStoredEvery) {
      ahead_ = std::max(ahead_ / 2, at_first);
    }
  }
  time_ = now;
  last_ = sequencer.stored_pace(ahead_);
  return last_;
}

void PaceLog::added_as(std::uint64_t input) {
  invariant(input > input_, "inputs are numbered in their order");
  input_ = input;
}

void PaceLog::stored(std::uint64_t inputs) {
  if (last_ && inputs >= input_) safe_ = last_->certain();
}

std::uint64_t PaceLog::basis_of(const Sequencer& sequencer) const {
  return sequencer.certain() <= safe_ ? 0 : input_;
}

}  // namespace tessera
