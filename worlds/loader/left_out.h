// What is left of a model where another model that it includes was left out.
#pragma once

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// Removes what leads to links, frames and models that `model`, a <model> without <include>, does not have:
// joints and frames, and models inside it that have no link. Each is told in `notices`. Returns whether a
// link is left.
bool remove_dangling(xml::Element& model, Notices& notices);

}  // namespace tessera
