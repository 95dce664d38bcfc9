#include "lpss/native/body_form.h"

#include <algorithm>
#include <iterator>

namespace tessera::native {
namespace {

bool is_trigger(const ShapePart& part) { return part.material && part.material->trigger; }

Shape parts_of(const Shape& shape, bool triggers) {
  Shape some;
  std::ranges::copy_if(shape.parts, std::back_inserter(some.parts),
                       [&](const ShapePart& part) { return is_trigger(part) == triggers; });
  return some;
}

}  // namespace

BodyForm::BodyForm(const Shape& shape, const Pose& centre, bool is_static)
    : are_all_triggers_(std::ranges::all_of(shape.parts, is_trigger)),
      solid_(are_all_triggers_ || !has_triggers(shape) ? shape : parts_of(shape, /*triggers=*/false), centre,
             is_static) {
  if (!are_all_triggers_ && has_triggers(shape))
    triggers_.emplace(parts_of(shape, /*triggers=*/true), centre, is_static);
}

}  // namespace tessera::native
