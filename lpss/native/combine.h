// How the surfaces of two bodies, or of their parts, combine where they touch.
#pragma once

#include <algorithm>

#include "lpss/native/body.h"
#include "lpss/native/contact.h"

namespace tessera::native {

// The friction of two bodies that touch with neither surfaces nor parts with materials of their own: the
// smaller one, as in Gazebo.
inline Scalar usual_friction(const Body& a, const Body& b) { return std::min(a.friction, b.friction); }

// Of bodies a and b, a.id < b.id, that touch with these parts; nullptr: with what has no material of its own.
ContactMaterial combined(const Body& a, const Part* p, const Body& b, const Part* q);

// Whether two parts of a wanted pair of bodies may touch, as far as their collision bits decide.
bool may_touch(const Body& a, const Part& p, const Body& b, const Part& q);

// Brings the materials of the patches of a contact up to date: of bodies of which one has parts with
// materials of their own. `is_new`: the patches were found anew.
void update_materials(const Body& a, const Body& b, bool is_new, Contact& contact);

// Gives its last patch, of a sweep, this material.
void add_predicted_material(const ContactMaterial& material, Contact& contact);

}  // namespace tessera::native
