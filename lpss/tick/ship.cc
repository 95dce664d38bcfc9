#include "lpss/tick/ship.h"

#include <string_view>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"

namespace tessera {
namespace {

template <typename Items>
std::string_view numbers_of(const Items& items, std::size_t n, std::string_view numbers) {
  const std::size_t begin = n > 0 ? items[n - 1].numbers_end : 0;
  const std::size_t end = items[n].numbers_end;
  return begin <= end && end <= numbers.size() ? numbers.substr(begin, end - begin) : std::string_view{};
}

}  // namespace

std::string_view numbers_of_body(const ShippedIsland& parcel, std::size_t n) {
  return numbers_of(parcel.bodies, n, parcel.body_numbers);
}

std::string_view numbers_of_pair(const ShippedIsland& parcel, std::size_t n) {
  return numbers_of(parcel.pairs, n, parcel.pair_numbers);
}

void ship_body(const HomeBody& body, SeamStages seam_stages, ShippedIsland& parcel) {
  body.sector->world->append_numbers(body.slot, parcel.body_numbers);
  parcel.bodies.push_back({body.id, body.sector->index, seam_stages, parcel.body_numbers.size()});
}

void ship_pair(const Sector& sector, std::size_t n, ShippedIsland& parcel) {
  const ContactPair& pair = sector.world->contacts()[n];
  sector.world->append_pair_numbers(n, parcel.pair_numbers);
  parcel.pairs.push_back({pair.a, pair.b, parcel.pair_numbers.size()});
}

void ship_part(const Partition& partition, const Sector& sector, const Component& component,
               ShippedIsland& parcel) {
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    const HomeBody& body = *sector.component_bodies[i];
    ship_body(body, 0, parcel);
    if (!body.jointed) continue;
    for_each_of_child(partition.joints, body.id,
                      [&](const JointRecord& joint) { parcel.joints.push_back(joint); });
  }
  for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i)
    ship_pair(sector, sector.component_pairs[i], parcel);
}

void take_solution(const IslandPlan& plan, const Solution& solution) {
  for (const SolvedIsland& island : solution.islands) {
    const auto shipped = plan.shipped.find(island.island);
    invariant(shipped != plan.shipped.end(), "a solution is of an island that was shipped");
    std::string_view bodies = island.bodies;
    std::string_view pairs = island.pairs;
    bool fits = true;
    for (const auto& [sector, component] : shipped->second) {
      SectorWorld& world = *sector->world;
      for (std::uint32_t i = component->bodies_begin; i < component->bodies_end; ++i)
        fits = fits && world.take_solved(sector->component_bodies[i]->slot, bodies);
      for (std::uint32_t i = component->pairs_begin; i < component->pairs_end; ++i)
        fits = fits && world.take_solved_pair(sector->component_pairs[i], pairs);
    }
    invariant(fits && bodies.empty() && pairs.empty(), "a solution is of all that was shipped");
  }
}

}  // namespace tessera
