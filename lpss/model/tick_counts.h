// What a tick counts, and the one list of it. What carries, sums or shows counters (reports of servers, the
// status, metrics, reports of runs) goes through the list, so that a new counter is a member and a row here,
// and the line that counts.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace tessera {

// Meanings: kTickCounters. Sums over all servers do not depend on how many there are.
struct TickCounts {
  std::uint64_t sectors = 0;
  std::uint64_t sectors_awake = 0;
  std::uint64_t bodies_awake = 0;
  std::uint64_t clones = 0;
  std::uint64_t contacts = 0;
  std::uint64_t islands_across_seams = 0;
  std::uint64_t islands_shipped = 0;
  std::uint64_t islands_in_step = 0;
  std::uint64_t diverged = 0;
  std::uint64_t programs = 0;

  bool operator==(const TickCounts&) const = default;
  constexpr TickCounts& operator+=(const TickCounts& other);  // over servers

  // Makes these the counts of a run that this tick, too, belongs to.
  constexpr void add_tick(const TickCounts& tick);
};

// What is worth knowing of many ticks.
enum class OverTicks {
  kMost,   // the most of any tick: of what there is at a time
  kTotal,  // of what happens
};

struct TickCounter {
  const char* name;  // in messages, JSON and metrics
  std::uint64_t TickCounts::*value;
  OverTicks over_ticks;
  const char* name_in_run;  // in the JSON of a run, with the value over all of its ticks
  const char* help;
};

// clang-format off
inline constexpr auto kTickCounters = std::to_array<TickCounter>({
    {"sectors", &TickCounts::sectors, OverTicks::kMost, "sectors_max",
     "Sectors with a body that can move"},
    {"sectors_awake", &TickCounts::sectors_awake, OverTicks::kMost, "sectors_awake_max",
     "Sectors that were stepped"},
    {"bodies_awake", &TickCounts::bodies_awake, OverTicks::kMost, "bodies_awake_max",
     "Bodies that moved"},
    {"clones", &TickCounts::clones, OverTicks::kMost, "clones_max",
     "Clones in engine worlds"},
    {"contacts", &TickCounts::contacts, OverTicks::kMost, "contacts_max",
     "Pairs of bodies in contact, in sectors that are awake"},
    {"islands_across_seams", &TickCounts::islands_across_seams, OverTicks::kMost, "islands_across_seams",
     "Islands over several sectors, counted where they are solved"},
    {"islands_shipped", &TickCounts::islands_shipped, OverTicks::kMost, "islands_shipped",
     "Of these, islands over several servers, solved by one of them"},
    {"islands_in_step", &TickCounts::islands_in_step, OverTicks::kMost, "islands_in_step",
     "Of these, islands over several servers, which solve them in step"},
    {"diverged", &TickCounts::diverged, OverTicks::kTotal, "diverged",
     "Bodies that left the range of numbers, speeds or sectors, and were stopped"},
    {"programs", &TickCounts::programs, OverTicks::kMost, "programs_max",
     "Instances of programs that ran"},
});
// clang-format on

static_assert(sizeof(TickCounts) == kTickCounters.size() * sizeof(std::uint64_t),
              "every counter is in the list");

constexpr TickCounts& TickCounts::operator+=(const TickCounts& other) {
  for (const TickCounter& counter : kTickCounters) this->*counter.value += other.*counter.value;
  return *this;
}

constexpr void TickCounts::add_tick(const TickCounts& tick) {
  for (const TickCounter& counter : kTickCounters) {
    std::uint64_t& value = this->*counter.value;
    const std::uint64_t now = tick.*counter.value;
    value = counter.over_ticks == OverTicks::kTotal ? value + now : std::max(value, now);
  }
}

}  // namespace tessera
