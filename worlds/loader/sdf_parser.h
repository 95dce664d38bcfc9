// The only interface to libsdformat's parser: no output, one thread at a time, errors as a status.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <initializer_list>
#include <sdf/Element.hh>
#include <sdf/Root.hh>
#include <string>
#include <vector>

#include "worlds/loader/notices.h"

namespace tessera {

// The version of SDF that libsdformat converts everything to, "1.9".
const std::string& latest_sdf_version();

// What SDF allows in an <sdf>, <world> or <physics>.
sdf::ElementConstPtr sdf_description(const std::string& name);

// The names of all that SDF allows in elements of the name `parent`.
std::vector<std::string> sdf_words_in(absl::string_view parent);

// Reads the text of one SDF model into `root`, and counts libsdformat's warnings.
// INVALID_ARGUMENT with libsdformat's errors.
absl::Status parse_sdf(const std::string& xml, sdf::Root& root, Notices& notices);

// SDF of any version, or URDF, as text in the latest version of SDF. Includes must have been removed.
absl::StatusOr<std::string> to_latest_sdf(const std::string& xml);

// An element deep in another that the DOM classes of libsdformat do not cover; null if the file has none.
sdf::ElementPtr find_element(sdf::ElementPtr element, std::initializer_list<const char*> path);

// Its value; false, and no change, if the file has none.
template <typename T>
bool find_value(const sdf::ElementPtr& element, std::initializer_list<const char*> path, T& value) {
  const sdf::ElementPtr found = find_element(element, path);
  if (found != nullptr) value = found->Get<T>();
  return found != nullptr;
}

}  // namespace tessera
