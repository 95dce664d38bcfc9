#include "experiments/catalogue.h"

#include "experiments/extremes/extremes.h"
#include "experiments/paper/distance.h"
#include "experiments/paper/instances.h"
#include "experiments/paper/overhead.h"
#include "experiments/paper/stacks.h"
#include "experiments/requirements/requirements.h"
#include "experiments/tradeoff/tradeoff.h"

namespace tessera {

const std::vector<Experiment>& all_experiments() {
  static const std::vector<Experiment> experiments = {
      {"distance",
       "What the distance from the origin does to a collision: one world, a shifted origin, sectors.",
       measure_distance},
      {"extremes",
       "The ends of what can be asked for: distances, masses, sizes, speeds, spins, steps, inputs, ages.",
       measure_extremes},
      {"instances", "What it costs to cut 128 bodies into up to 128 sectors: time and memory.",
       measure_instances},
      {"overhead",
       "Where the time of a tick goes, for 128 to 32,768 bodies, and what plain Bullet takes for them.",
       measure_overhead},
      {"requirements", "What it saves to model only what a scene requires, and what error it leaves.",
       measure_requirements},
      {"stacks", "Towers near and far from the origin, in one world and in sectors.", measure_stacks},
      {"tradeoff", "What each knob costs and what error it leaves, on small scenes.", measure_tradeoff},
  };
  return experiments;
}

}  // namespace tessera
