#include "lpss/tick/tick_counts.h"

namespace tessera {

TickCounts& TickCounts::operator+=(const TickCounts& other) {
  sectors += other.sectors;
  sectors_awake += other.sectors_awake;
  bodies_awake += other.bodies_awake;
  clones += other.clones;
  contacts += other.contacts;
  islands_across_seams += other.islands_across_seams;
  islands_shipped += other.islands_shipped;
  islands_cut += other.islands_cut;
  bodies_stopped += other.bodies_stopped;
  return *this;
}

}  // namespace tessera
