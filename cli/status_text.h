// How a cluster is, for people to read.
#pragma once

#include <string>

#include "tessera/client.h"

namespace tessera::cli {

// "12 MB", of 10^6 bytes.
std::string megabytes(double bytes);

// What a server is called: "1f3a", and whether it is silent or takes no part in the world.
std::string label(const ServerStatus& server);

// Some lines: what the world does and how fast, what is in it, how long ticks take; and what ended it.
std::string summary(const ClusterStatus& status);

}  // namespace tessera::cli
