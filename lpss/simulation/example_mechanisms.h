// Mechanisms made in code, for tests and experiments: loops of joints, whose rows follow from each other and
// which are near to where they could not move at all; and trees that tumble.
#pragma once

#include "lpss/model/world_description.h"

namespace tessera {

// A Grashof four-bar of 5 kg a bar in the plane y = 0, the crank on "hinge0" with the world.
WorldDescription four_bar_world(const WorldSettings& settings);

// Ten planks of 20 kg and 1 m width between two posts, about 10 m apart; they hang through by about `sag` m,
// more on the right: they swing.
WorldDescription bridge_world(const WorldSettings& settings, double sag);

// `side` x `side` balls of 1 kg, half a metre apart on a level, with a ball joint between neighbours; held at
// its corners, or along a side.
WorldDescription net_world(const WorldSettings& settings, int side, bool at_corners);

// Eight compact links at random places in 0.3 m, each hung from the world or one before it by a ball joint
// next to its centre: they swing on levers that are long for them, and turn by a radian and more in a tick.
WorldDescription tumbling_tree_world(const WorldSettings& settings, unsigned seed);

}  // namespace tessera
