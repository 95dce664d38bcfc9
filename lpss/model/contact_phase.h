// What happens to a contact of two bodies in a tick.
#pragma once

#include <cstdint>

namespace tessera {

// In the order in which a tick reports them of one pair: bodies that part and meet again within a tick (a
// teleport) end their contact before they begin another.
enum class ContactPhase : std::uint8_t { kEnd, kBegin, kPersist };

}  // namespace tessera
