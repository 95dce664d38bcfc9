// Mesh files that are right, and that assimp (5.2) does not read as they stand.
#pragma once

#include <absl/strings/string_view.h>

#include <optional>
#include <string>

#include "worlds/loader/xml.h"

namespace tessera {

// An OBJ file in which all numbers of vertices have a digit before the point: assimp takes ".5" for no
// number. Nothing if all have.
std::optional<std::string> amended_obj(absl::string_view text);

// A COLLADA file without blanks before numbers, and without materials, which are not used: assimp refuses
// files for either. Changes `collada`, which is worthless afterwards. Nothing if there is neither.
std::optional<std::string> amended_collada(xml::Element& collada);

}  // namespace tessera
