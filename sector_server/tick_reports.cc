#include "sector_server/tick_reports.h"

#include <chrono>
#include <cstdint>

#include "lpss/model/divergence.h"
#include "lpss/observe/state.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"

namespace tessera {
namespace {

std::uint64_t in_us(TickMeter::Nanoseconds time) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(time).count());
}

}  // namespace

void TickReports::add(Tick tick, const TickMachine& machine, const TickMeter::Times& times) {
  last_.set_tick(tick);
  last_.set_work_us(in_us(times.all));
  last_.set_own_us(in_us(times.own));
  write(machine.counts(), *last_.mutable_counts());
  last_.clear_divergences();
  for (const Divergence& divergence : first_divergences(machine.divergences()))
    *last_.add_divergences() = to_proto(divergence);
  last_.clear_removed_joints();
  if (machine.partition().self == 0) {
    for (const JointId joint : machine.joints_removed()) last_.add_removed_joints(joint.value);
  }
  if (hashes_) {
    const WorldHash hash = hash_of(machine.partition());
    last_.set_hash_low(hash.low());
    last_.set_hash_high(hash.high());
    const WorldHash programs = program_hash_of(machine.partition());
    last_.set_programs_low(programs.low());
    last_.set_programs_high(programs.high());
  }
  waiting_.push_back(last_);
}

}  // namespace tessera
