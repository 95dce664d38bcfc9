#include "experiments/catalogue.h"

#include "experiments/clients/clients.h"
#include "experiments/extremes/extremes.h"
#include "experiments/ground/ground.h"
#include "experiments/joints/joints.h"
#include "experiments/joints/models.h"
#include "experiments/motion/motion.h"
#include "experiments/paper/distance.h"
#include "experiments/paper/instances.h"
#include "experiments/paper/overhead.h"
#include "experiments/paper/stacks.h"
#include "experiments/performance/checkpoints.h"
#include "experiments/performance/idle.h"
#include "experiments/performance/performance.h"
#include "experiments/performance/scaling.h"
#include "experiments/programs/outside.h"
#include "experiments/programs/programs.h"
#include "experiments/requirements/requirements.h"
#include "experiments/robots/robots.h"
#include "experiments/scale/scale.h"
#include "experiments/tradeoff/tradeoff.h"
#include "experiments/truth/truth.h"

namespace tessera {

const std::vector<Experiment>& all_experiments() {
  static const std::vector<Experiment> experiments = {
      {"checkpoints",
       "What it costs that a world survives the loss of a process, by how often its state is kept.",
       measure_checkpoints},
      {"clients",
       "What clients get from a cluster: commands and queries a second, latencies, steps in lock step.",
       measure_clients, /*has_scenes=*/true},
      {"distance",
       "The effect of the distance from the origin on a collision: one world, a shifted origin, sectors.",
       measure_distance},
      {"extremes",
       "The limits of the input range: distances, masses, sizes, speeds, spins, steps, inputs, ages.",
       measure_extremes, /*has_scenes=*/true},
      {"ground",
       "A planet with ground everywhere: memory, ticks that waited for it, the same bits on servers.",
       measure_ground},
      {"idle", "What a million sectors cost in which everything sleeps: time and memory.", measure_idle},
      {"instances", "The cost of dividing 128 bodies among up to 128 sectors: time and memory.",
       measure_instances},
      {"joints",
       "Joints of every type, chains, loops and drives: gaps, energy, errors, compared with Bullet's own.",
       measure_joints, /*has_scenes=*/true},
      {"models",
       "World files of other projects: which load, hold together and come to rest; robots on a plane.",
       measure_models, /*has_scenes=*/true, /*has_worlds=*/true},
      {"motion",
       "Scenes in frames that move, up to 3e7 m/s: bits, times, what sleeps, trains that brake; a day in "
       "orbit.",
       measure_motion, /*has_scenes=*/true},
      {"outside", "A crowd that decides as programs, and as the code of a client: ticks, latency, bytes.",
       measure_outside},
      {"overhead", "The time of a tick by phase, for 128 to 32,768 bodies, compared with plain Bullet.",
       measure_overhead},
      {"performance",
       "What a core does: piles, towers, a pyramid and mixed bodies, compared with plain Bullet.",
       measure_performance, /*has_scenes=*/true},
      {"programs", "What programs cost: characters that walk and wander, cars, lifts.", measure_programs},
      {"robots",
       "Ants and humanoids with servos on a plane: time, and errors of joints and energy, compared with "
       "MuJoCo\n"
       "where the build has it.",
       measure_robots, /*has_scenes=*/true},
      {"scale",
       "A crowd that crosses the sectors of four servers, by the policy that divides them; worlds that grow\n"
       "with their servers: messages and memory of one.",
       measure_scale, /*has_scenes=*/true},
      {"scaling", "What a second thread and a second server give on the same scenes.", measure_scaling,
       /*has_scenes=*/true},
      {"requirements", "The savings of computing only what a scene requires, and the remaining error.",
       measure_requirements},
      {"stacks", "Towers near and far from the origin, in one world and in sectors.", measure_stacks},
      {"tradeoff", "The cost and the remaining error of each setting, on small scenes.", measure_tradeoff},
      {"truth",
       "Scenes whose motion mechanics gives in closed form: rests, slides, impacts, flush floors, carriers,\n"
       "orbits, rays; compared with plain Bullet, and with MuJoCo where the build has it.",
       measure_truth, /*has_scenes=*/true},
  };
  return experiments;
}

}  // namespace tessera
