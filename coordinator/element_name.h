// Names an element of a list of commands or queries in an error.
#pragma once

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include "lpss/model/checks.h"

namespace tessera {

// "commands[3] (spawn): ...", where the list has others.
template <typename Element>
absl::Status at_element(const absl::Status& status, absl::string_view list, int place, const Element& element,
                        int count) {
  if (count == 1) return status;
  const auto* kind = Element::descriptor()->FindFieldByNumber(element.kind_case());
  return in(absl::StrCat(list, "[", place, "]", kind == nullptr ? "" : absl::StrCat(" (", kind->name(), ")")),
            status);
}

}  // namespace tessera
