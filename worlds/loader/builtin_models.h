// The models that every Gazebo has.
#pragma once

#include <string>

namespace tessera {

// The SDF file of model://sun (a light) or model://ground_plane (a static plane), also where a URI names them
// in the network; nullptr for other URIs. For use where the search for files found nothing.
const char* builtin_model(const std::string& uri);

}  // namespace tessera
