// Whether what is solid of a body overlaps a trigger: yes or no, without points.
#pragma once

#include <cstdint>
#include <vector>

#include "lpss/native/body.h"

namespace tessera::native {

// Surfaces (meshes, height fields) have no inside: what is wholly beside one does not overlap it. A plane is
// the half space behind it.
//
// For one thread at a time.
class OverlapSearch {
 public:
  // Whether a trigger of one body overlaps the visitor where both are. What just touches does not.
  bool overlaps(const Body& trigger, const Body& visitor);

  // Whether it does so on the visitor's way (m), as the trigger sees it, of what goes farther than half of
  // the thicker of two parts: the others overlap where the way begins or ends, if at all. Without turning.
  bool meets(const Body& trigger, const Body& visitor, const Vector& way);

 private:
  // Whether `test` is true of a trigger and a part of the visitor that collision bits do not keep apart, and
  // whose boxes overlap within the way.
  template <typename Test>
  bool any_pair(const Body& trigger, const Body& visitor, const Vector& way, const Test& test);
  template <typename Test>
  bool any_pair(const Solid& triggers, const Body& trigger, const Body& visitor, const Vector& way,
                const Test& test);

  std::vector<std::uint32_t> triggers_;
  std::vector<std::uint32_t> parts_;
};

// The pose of a solid that a trigger's body has (Sensor).
Frame frame_of(const Body& body, const Solid& solid);

// Of all triggers of the body.
Bounds sensor_bounds(const Body& body);

}  // namespace tessera::native
