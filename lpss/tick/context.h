// What one tick needs: made anew each tick, and gone with it. What lasts is in the partition.
#pragma once

#include <vector>

#include "lpss/model/tick_counts.h"
#include "lpss/partition/partition.h"
#include "lpss/partition/sectors.h"
#include "lpss/tick/divergences.h"
#include "lpss/tick/island_plan.h"
#include "lpss/tick/messages.h"

namespace tessera {

struct TickContext {
  Tick tick = 0;
  std::vector<Command> commands;

  // From detection: the sectors that take part in this tick, to which islands add those that they wake, and
  // what those left behind that lost their last body.
  std::vector<Sector*> stepped;
  Vacated vacated;

  // From the islands: what is to be solved here, and who waits for whom.
  IslandPlan plan;

  // Bodies that have been stopped so far, and the joints to blame, wherever they were solved.
  std::vector<Stopped> stopped;
  BlamedJoints blamed;

  std::vector<BodyId>
      changed_triggers;  // into which something came, or which it left; each may be in it often

  std::vector<FrameBurden> burdens;  // of frames with carriers, as far as they live here

  // For those who watch.
  std::vector<JointId> joints_removed;  // by programs
  std::vector<Divergence> divergences;
  std::vector<ContactEvent> trigger_events;  // from detection on, until they join the others
  std::vector<ContactEvent> events;          // ascending by (a, b), then those of triggers, likewise
  TickCounts counts;
};

}  // namespace tessera
