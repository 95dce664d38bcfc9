// What a call of service Streams carries that goes through a gateway: which sector server it is for.
#pragma once

namespace tessera {

inline constexpr const char* kServerHeader = "tessera-server";  // ServerStatus.node, in decimal digits

}  // namespace tessera
