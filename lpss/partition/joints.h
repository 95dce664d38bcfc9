// Joints of a partition: they tie bodies of any two sectors into one island, and wake what they tie.
//
// A joint is known where its bodies live, and where a joint lives that is coupled with it (joint_index.h):
// its record moves with its child. Under the seam policy clone, whose clones collide with each other, the
// ties of all joints are known to all partitions.
#pragma once

#include <span>

#include "lpss/partition/body_joints.h"
#include "lpss/partition/partition.h"

namespace tessera {

// Whether all partitions know the ties of all joints.
bool all_know_joints(const WorldSettings& settings);

// A new joint between bodies of the world, wherever they live: nothing happens where it is not to be known.
// `leaders` are the ties of those that its axes follow.
void add_joint(Partition& partition, const JointRecord& record, std::span<const JointTie> leaders = {});

// Likewise of a new world, in any order, once its bodies are there: all of its joints, or at least those that
// the partition is to know, and those coupled with them.
void add_joints(Partition& partition, std::span<const JointRecord> records);

// Nothing happens where there is no such joint.
void remove_joint(Partition& partition, JointId id);
void remove_joints_of(Partition& partition, BodyId body);
void set_drives(Partition& partition, JointId id, const JointDrives& drives, AxisMask axes = kBothAxes);

// Of a body that lives here.
BodyJoints joints_of(const Partition& partition, BodyId body);

// The joints of a body that is about to live here.
void take_joints(Partition& partition, const BodyJoints& joints);

// A tie that all partitions know.
void take_tie(Partition& partition, const JointTie& tie);

// Joints of a body that does not live here any more; review_joints() forgets those that need not be known.
void leave_joints(Partition& partition, BodyId body);
void review_joints(Partition& partition);

// Wakes the bodies of a joint that changes, and those that follow it or that it follows.
void wake_jointed(Partition& partition, const JointTie& joint);

// A kinematic body may lead a joint whose other side lives anywhere, and one that goes far has clones only
// where somebody lives, which changes: all servers are told where they are.
bool is_everywhere(bool jointed, Motion motion, const OffsetSet& replicated_in);

// Whether the joint's parent is kinematic and on its way: it keeps the child awake.
bool is_pushed_by(const Partition& partition, const JointTie& joint);

}  // namespace tessera
