// The shape of a body as a world takes it: what of it touches, and what of it only notices.
#pragma once

#include <memory>
#include <optional>

#include "lpss/native/solid.h"

namespace tessera::native {

// Immutable; shared by all bodies of a shape and centre frame. Triggers change nothing of what touches: a
// body with them moves as one without.
class BodyForm {
 public:
  BodyForm(const Shape& shape, const Pose& centre, bool is_static);

  // Of the parts that touch; where all are triggers, of these. As long as it is held, so is the form.
  static std::shared_ptr<const Solid> solid_of(const std::shared_ptr<const BodyForm>& form) {
    return {form, &form->solid_};
  }

  // Of the parts that are triggers; null if none is.
  static std::shared_ptr<const Solid> triggers_of(const std::shared_ptr<const BodyForm>& form) {
    if (form->are_all_triggers_) return solid_of(form);
    if (!form->triggers_) return nullptr;
    return {form, &*form->triggers_};
  }

  bool are_all_triggers() const { return are_all_triggers_; }

 private:
  bool are_all_triggers_;
  Solid solid_;
  std::optional<Solid> triggers_;
};

}  // namespace tessera::native
