// What is said of the elements of SDF and URDF that are not simulated.
#pragma once

#include <absl/strings/string_view.h>

#include <sdf/Element.hh>

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// Counts what a model, as libsdformat has read it, says beyond what is simulated: elements of SDF with a
// value other than their default, by their own names, and unknown elements, with the nearest known word.
void note_unread(const sdf::Element& model, Notices& notices);

// The same for an element of a <world>, or of a <physics>, that is not read.
void note_unread(const xml::Element& element, Notices& notices);

// Removes from a URDF robot what is not simulated, and counts it; unknown elements and attributes are counted
// with the nearest known word.
void remove_unread(xml::Element& robot, Notices& notices);

}  // namespace tessera
