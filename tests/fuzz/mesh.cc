// Files of meshes: the first byte says of which format, s(tl), o(bj), d(ae), g(ltf) or b (glb).
#include <cmath>

#include "lpss/base/invariant.h"
#include "tests/fuzz/temporary_file.h"
#include "worlds/loader/mesh_file.h"

namespace tessera {
namespace {

const char* extension_of(std::uint8_t format) {
  switch (format) {
    case 's':
      return ".stl";
    case 'o':
      return ".obj";
    case 'd':
      return ".dae";
    case 'g':
      return ".gltf";
    case 'b':
      return ".glb";
    default:
      return nullptr;
  }
}

}  // namespace
}  // namespace tessera

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  const char* extension = size == 0 ? nullptr : extension_of(data[0]);
  if (extension == nullptr) return 0;
  const fuzz::TemporaryFile file(extension, data + 1, size - 1);
  const absl::StatusOr<std::vector<SubMesh>> read = read_mesh_file(file.path());
  if (!read.ok()) return 0;
  for (const SubMesh& part : *read) {
    for (const std::uint32_t index : part.indices)
      invariant(index < part.vertices.size(), "a triangle has vertices that there are");
    invariant(hull_points(part.vertices, 16).size() <= part.vertices.size(), "a hull has no more points");
  }
  return 0;
}
