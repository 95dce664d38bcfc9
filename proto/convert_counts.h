// The counters and times of ticks as messages. Counters go between servers by their places in kTickCounters,
// since both ends are of one build, and to clients by name.
#pragma once

#include <google/protobuf/map.h>
#include <google/protobuf/repeated_field.h>

#include <cstdint>
#include <string>

#include "lpss/model/tick_counts.h"
#include "lpss/model/tick_times.h"
#include "tessera.pb.h"

namespace tessera {

using CountsByPlace = google::protobuf::RepeatedField<std::uint64_t>;
using CountsByName = google::protobuf::Map<std::string, std::uint64_t>;

void write(const TickCounts& counts, CountsByPlace& message);
void write(const TickCounts& counts, CountsByName& message);

// What is absent is 0; what is not in the list is left out.
TickCounts counts_from(const CountsByPlace& message);
TickCounts counts_from(const CountsByName& message);

void write(const TickTimes& times, v1::TickTimes& message);
TickTimes times_from(const v1::TickTimes& message);

}  // namespace tessera
