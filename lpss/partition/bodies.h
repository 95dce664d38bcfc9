// Bodies of a partition: those that can move, and the shapes that bodies refer to.
#pragma once

#include "lpss/partition/partition.h"

namespace tessera {

// --- before the first tick ---

// A shape id is given once, and before bodies use it.
void add_shape(Partition& partition, ShapeId id, ShapeRef shape);

// No body has it any more. Does nothing for one that is unknown.
void forget_shape(Partition& partition, ShapeId id);

// Bodies may have programs of it from now on. Does nothing where the world has it.
void add_module(Partition& partition, const std::shared_ptr<const ProgramModule>& module);

// Static bodies: all of the world, on every server. Others: only those whose home the partition hosts are
// taken.
void add_body(Partition& partition, const BodyRecord& record);

// The largest radius (m) of a body that can move, of the whole world: what decides how near to a seam is
// near. Needed where add_body() is not told of all of them.
void expect_radius(Partition& partition, double radius);

// --- at any time ---

// m, of a ball around the centre of mass that holds the shape.
double radius_of(const Partition& partition, const BodyProperties& properties);

// Gives a body its home in one of the partition's sectors.
HomeBody& add_home(Partition& partition, const BodyRecord& record);

// Gives a body that lives here other properties, of the same shape and centre frame, and wakes it. Its
// contacts are found anew.
void set_home_properties(Partition& partition, HomeBody& body, const BodyProperties& properties);

// Of a body that lives here; it is not woken.
void set_lasting_force(HomeBody& body, const std::optional<LastingForce>& lasting);

// Has a body that lives here and carries frames be solved with what is aboard (Partition::carried).
void load_ballast(const Partition& partition, HomeBody& body);

// Of all frames that a body carries; none if it carries no frame.
std::optional<Ballast> ballast_of(const Partition& partition, BodyId body);

// Takes it away; the body is gone from the partition.
BodyRecord remove_home(Partition& partition, HomeBody& body);

BodyRecord record_of(const HomeBody& body);

// Has the next exchange look at a body: whether others must hear of it, and of what.
void attend(HomeBody& body);
// Has the next exchange tell its state to those who know it.
void mark_dirty(HomeBody& body);
// Has the next tick look at a body, awake if it is dynamic, and others hear of it.
void wake_home(Partition& partition, HomeBody& body);

// All that live in the partition's sectors, packed or not.
std::size_t body_count(const Partition& partition);

// Static for those that are neither at home here nor known as replicas.
Motion motion_of(const Partition& partition, BodyId id);

// The home of a body from the next change of homes on. Of one that the partition does not know, any sector.
const SectorIndex& next_home(const Partition& partition, BodyId id);

bool lives_in(const Partition& partition, BodyId id, const Sector& sector);

}  // namespace tessera
