// Patches of contact as clients are told of them.
#pragma once

#include "lpss/partition/contact_patch.h"
#include "query.pb.h"

namespace tessera {

// All but the phase.
v1::Contact to_proto(BodyId a, BodyId b, const ContactPatch& patch);

}  // namespace tessera
