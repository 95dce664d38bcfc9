// Faults of files that are mended alike in SDF and URDF.
#pragma once

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

inline constexpr char kMasslessLink[] = "link without mass, given a hundredth of that of the nearest link";

inline constexpr char kCrossedLimits[] = "joint whose lower limit is above the upper one, exchanged";

// In SDF, unlike in URDF, a joint must not have the name of a link, frame or model beside it, nor be named
// "world": such joints of `model`, a <model> or <robot>, get the suffix "_joint".
void rename_joints(xml::Element& model, Notices& notices);

// SDF reserves the name "world". A link with this name and nothing in it stands for the world, and is
// removed; another one of `model` gets the suffix "_link".
void settle_world_link(xml::Element& model, Notices& notices);

// Collisions of `link` with a name that one before has get a number as suffix: "_2".
void rename_collisions(xml::Element& link, Notices& notices);

// Negative coefficients of an <ode> or <bullet> in a <friction> are infinite ones in Gazebo: what comes next
// to it takes their place.
void repair_friction(xml::Element& engine, Notices& notices);

// Sizes next to 0 of a shape, as spheres that stand for points have them, are raised to the least.
void repair_sizes(xml::Element& shape, Notices& notices);

// Files up to SDF 1.2 have a root named <gazebo>, and no other difference: it gets the name <sdf>.
void rename_root(xml::Element& root, Notices& notices);

}  // namespace tessera
