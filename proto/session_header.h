// What a stream of requests carries beside them, so that one whose reply was lost can be made again.
#pragma once

namespace tessera {

inline constexpr const char* kSessionHeader = "tessera-session";  // a number that the client has drawn

}  // namespace tessera
