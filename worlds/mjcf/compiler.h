// The door between the reader of MJCF and MuJoCo, which is in a module of its own (libtessera-mjcf.so), so
// that processes that read no MJCF do not load it.
#pragma once

#include <mujoco/mjmodel.h>

#include <string>

namespace tessera::mjcf {

inline constexpr char kCompileEntry[] = "tessera_mjcf_compile";
inline constexpr char kDeleteEntry[] = "tessera_mjcf_delete";
inline constexpr char kInterfaceEntry[] = "tessera_mjcf_interface";

// The model of a text; paths in it are relative to `folder`. Null with what is wrong in `error`. Throws
// where MuJoCo would end the process. By one thread at a time.
using Compile = mjModel*(const std::string& folder, const std::string& text, std::string& error);
using Delete = void(mjModel* model);

}  // namespace tessera::mjcf
