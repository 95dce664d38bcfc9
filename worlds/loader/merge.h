// <include merge='true'>: a model whose links, joints, frames and models become those of another one.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "worlds/loader/xml.h"

namespace tessera {

// Copies what `source`, a <model> in SDF 1.7 or later without a <pose>, consists of to the end of `model`, in
// the same format. Where it names itself, a frame named `proxy` stands for it, which is added without a
// <pose>, and returned. INVALID_ARGUMENT if the model has no link.
absl::StatusOr<xml::Element*> merge_model(const xml::Element& source, const std::string& proxy,
                                          xml::Element& model);

}  // namespace tessera
