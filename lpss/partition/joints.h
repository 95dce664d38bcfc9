// Joints of a partition: they tie bodies of any two sectors into one island, and wake what they tie.
#pragma once

#include "lpss/partition/partition.h"

namespace tessera {

// A joint between bodies of the world, wherever they live: every server knows all of them.
void add_joint(Partition& partition, const JointRecord& record);

// Nothing happens where there is no such joint.
void remove_joint(Partition& partition, JointId id);
void remove_joints_of(Partition& partition, BodyId body);
void set_drives(Partition& partition, JointId id, const JointDrives& drives);

// Wakes the bodies of a joint that changes, and those that follow it or that it follows.
void wake_jointed(Partition& partition, const JointRecord& joint);

// A kinematic body may lead a joint whose other side lives anywhere, so all servers are told where it is.
bool is_everywhere(const HomeBody& body);

// Whether the joint's parent is kinematic and on its way: it keeps the child awake.
bool is_pushed_by(const Partition& partition, const JointRecord& joint);

}  // namespace tessera
