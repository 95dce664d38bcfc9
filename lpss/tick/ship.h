// Shipping: the parts of islands travel to the server that solves them, and the solution travels back.
#pragma once

#include "lpss/tick/context.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Packs a component: its bodies with their joints, and its contacts.
void ship_part(const Partition& partition, const Sector& sector, const Component& component,
               ShippedIsland& parcel);

// One body, or one contact of those that the sector has detected.
void ship_body(const HomeBody& body, SeamStages seam_stages, ShippedIsland& parcel);
void ship_pair(const Sector& sector, std::size_t pair, ShippedIsland& parcel);

// Takes over what another server has made of the parts that the plan says were shipped.
void take_solution(const IslandPlan& plan, const Solution& solution);

}  // namespace tessera
