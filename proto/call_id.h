// What calls carry beside their messages, so that one whose answer was lost can be made again and runs once.
#pragma once

namespace tessera {

inline constexpr const char* kSessionHeader = "tessera-session";  // a number that the client has drawn
inline constexpr const char* kCallHeader = "tessera-call";        // counts its calls from 1 on
// At the end of each answer: a call that ends without it was lost on the way, or with the one who had it.
inline constexpr const char* kAnsweredTrailer = "tessera-answered";

}  // namespace tessera
