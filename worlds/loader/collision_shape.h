// From the collision elements of a link to the shape of a body.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <memory>
#include <sdf/Link.hh>
#include <string>
#include <vector>

#include "lpss/model/shape.h"
#include "worlds/loader/mesh_file.h"
#include "worlds/loader/notices.h"

namespace tessera {

// Mesh files, each read once, and height fields that stood in the world file itself.
class MeshLibrary {
 public:
  absl::StatusOr<const std::vector<SubMesh>*> mesh(const std::string& file);

  // Keeps a height field, and gives the name that stands for it in a mesh's <uri>.
  std::string add(HeightField field);

  // The height field of that name, or nullptr where it is the name of a file.
  const HeightField* height_field(const std::string& name) const;

 private:
  absl::flat_hash_map<std::string, std::unique_ptr<std::vector<SubMesh>>> meshes_;
  absl::flat_hash_map<std::string, HeightField> height_fields_;
};

// All collisions of a link as one shape in the link's frame; without parts where it has none. `moves` says
// that the body can move: each object of a mesh file is then taken for the convex hull of its points, and as
// a surface of triangles otherwise.
absl::StatusOr<Shape> shape_of(const sdf::Link& link, bool moves, MeshLibrary& meshes, Notices& notices);

}  // namespace tessera
