// How far a world is certain to run, as its store has it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "coordinator/sequencer.h"
#include "lpss/tick/messages.h"
#include "store.pb.h"

namespace tessera {

// Ticks are stored as certain before they are granted, early enough that grants need not wait for it; a
// coordinator that takes over does at most so many more than were done.
class PaceLog {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  // The pace to be stored now; nothing while that would say no more than what is stored already, or soon. The
  // caller stores it as the input of that number.
  std::optional<v1::StoredPace> next(const Sequencer& sequencer, Nanoseconds now);
  void added_as(std::uint64_t input);

  // So many inputs are stored.
  void stored(std::uint64_t inputs);

  // The number of the input that makes certain what is granted so far; 0: that is stored.
  std::uint64_t basis_of(const Sequencer& sequencer) const;

  // It is to be stored anew, after what is stored instead of the inputs so far.
  void renew() { last_.reset(); }
  // The stored pace makes this tick certain.
  void resume(Tick certain) { safe_ = certain; }

 private:
  bool is_known(const v1::StoredPace& next, const Sequencer& sequencer) const;

  std::optional<v1::StoredPace> last_;
  std::uint64_t input_ = 0;  // the number of the last one
  Nanoseconds time_{};       // when that was
  std::uint64_t ahead_ = 0;  // ticks that it makes certain beyond those that were granted
  Tick safe_ = 0;            // that a stored pace makes certain
};

}  // namespace tessera
