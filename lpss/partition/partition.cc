#include "lpss/partition/partition.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace tessera {

EngineSettings engine_settings(const WorldSettings& settings) {
  EngineSettings result{settings};
  result.plain_bullet = seam_rules(settings.seams).clones_are_solved();
  const bool has_planet = std::holds_alternative<CentralGravity>(settings.gravity);
  // A pull of 0.006 m/s^2 is less than the last digit of 30 km/s in single precision.
  const bool varies = has_planet || std::ranges::any_of(settings.frames, [](const MovingFrame& frame) {
                        return frame.carrier || !frame.spin.isZero(0) || !frame.keys.empty();
                      });
  result.fine_flight = settings.precision == Precision::kFloat32 && varies;
  // Where ships dock in orbit. In worlds without frames, bits stay what they were.
  result.jointed_flight = has_planet && !settings.frames.empty();
  return result;
}

Partition::Partition(PartitionOptions options, Engine& engine_of_settings)
    : settings(std::move(options.settings)),
      rules(seam_rules(settings.seams)),
      anchor(options.anchor),
      map(std::move(options.map)),
      self(options.self),
      free_flight(options.free_flight),
      in_step_from(options.in_step_from),
      pack_after(options.pack_after),
      all_linked_max(options.all_linked_max),
      engine(engine_of_settings),
      margins(seam_margins(settings.sector_size, settings.time_step, 0)),
      statics(settings.sector_size, options.tiles != nullptr ? *options.tiles : TileStore::of_process()),
      carried(carried_at_start(settings)),
      felt(felt_in_frames(settings, 0, carried)),
      felt_changes(felt.size(), 1) {
  for (CarriedFrame& frame : carried) frame.felt = felt[frame.frame].steps();
}

}  // namespace tessera
