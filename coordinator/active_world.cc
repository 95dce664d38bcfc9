#include "coordinator/active_world.h"

#include <utility>

namespace tessera {

ActiveWorld active_world(const WorldToLoad& from, std::uint64_t load, std::uint64_t number,
                         std::vector<NodeId> nodes, std::uint32_t grant_window, bool keeps_past) {
  ActiveWorld world{
      .load = load,
      .number = number,
      .name = from.name(),
      .anchor = from.anchor(),
      .map = SectorMap(from.anchor(), {}, /*epoch=*/0),
      .registry = registry_of(from),
      .sequencer =
          Sequencer({number, nodes.size(), from.settings().time_step, grant_window, from.tick(), keeps_past}),
      .statistics = TickStatistics(nodes),
      .servers = Roster(std::move(nodes)),
  };
  world.sequencer.hold(held_of(from));
  return world;
}

WorldCatalogue with_held(const ActiveWorld& world, WorldCatalogue catalogue) {
  catalogue.name = world.name;
  const ShapeTable& shapes = world.registry.shapes();
  for (const SequencedCommands& batch : world.sequencer.held()) {
    WorldCatalogue::HeldBatch& held = catalogue.held.emplace_back();
    held.commands = batch.commands.unpacked();
    for (const v1::NumberedShape& shape : batch.new_shapes)
      held.new_shapes.push_back({shape.id(), shapes.ref(shape.id())});
  }
  return catalogue;
}

}  // namespace tessera
