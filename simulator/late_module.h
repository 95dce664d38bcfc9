// A program in WebAssembly that simulated worlds do not begin with.
#pragma once

#include "lpss/model/program.h"
#include "tessera.pb.h"

namespace tessera {

// That of worlds/flee.sdf. Null where this process cannot run programs in WebAssembly.
const std::shared_ptr<const ProgramModule>& late_module();

// Gives a model the module, where a body of it has such a program.
void bring_late_module(v1::Model& model);

}  // namespace tessera
