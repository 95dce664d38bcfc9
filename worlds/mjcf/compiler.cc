// The module with MuJoCo in it.
#include "worlds/mjcf/compiler.h"

#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>

namespace {

// Its own name, so that no file beside it is read in its place.
constexpr char kName[] = "tessera_world.xml";

[[noreturn]] void refuse(const char* message) { throw std::runtime_error(message); }

void ignore(const char*) {}  // else MuJoCo writes a file

}  // namespace

#define TESSERA_ENTRY extern "C" __attribute__((visibility("default")))

TESSERA_ENTRY const char* tessera_mjcf_interface() { return TESSERA_MJCF_INTERFACE; }

TESSERA_ENTRY mjModel* tessera_mjcf_compile(const std::string& folder, const std::string& text,
                                            std::string& error) {
  mju_user_error = refuse;
  mju_user_warning = ignore;
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  if (mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(text.size())) != 0) throw std::bad_alloc();
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kName)], text.data(), text.size());
  std::array<char, 1000> message{};
  const std::string path = folder.empty() ? kName : folder + "/" + kName;
  mjModel* const model =
      mj_loadXML(path.c_str(), files.get(), message.data(), static_cast<int>(message.size()));
  mj_deleteVFS(files.get());
  error = message.data();
  return model;
}

TESSERA_ENTRY void tessera_mjcf_delete(mjModel* model) { mj_deleteModel(model); }
