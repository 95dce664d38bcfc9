// Converts the collision elements of a link to the shape of a body.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <memory>
#include <sdf/Link.hh>
#include <sdf/Mesh.hh>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/shape.h"
#include "worlds/loader/given_geometry.h"
#include "worlds/loader/look.h"
#include "worlds/loader/mesh_file.h"
#include "worlds/loader/notices.h"

namespace tessera {

// Mesh files, each read once, and geometry that passes through libsdformat by a name.
class MeshLibrary {
 public:
  absl::StatusOr<const std::vector<SubMesh>*> mesh(const std::string& file);

  // Stores a geometry, and returns the name that represents it in a mesh's <uri>: that of an equal one, too.
  std::string add(GivenGeometry geometry);

  // The geometry of that name, or nullptr if it is the name of a file.
  const GivenGeometry* given(const std::string& name) const;

  // Whether the objects to be divided have had few enough triangles so far, with one of so many more.
  bool may_divide(std::size_t triangles);

 private:
  std::size_t divided_triangles_ = 0;
  absl::flat_hash_map<std::string, std::unique_ptr<std::vector<SubMesh>>> meshes_;
  absl::flat_hash_map<std::string, GivenGeometry> given_;
  absl::flat_hash_map<std::pair<std::string, std::size_t>, std::string> divided_;  // names
};

// The chosen objects of a mesh file as one surface. Errors as read_mesh_file(); INVALID_ARGUMENT for objects
// that are not there and for a scale of 0. An empty one for what is no file.
absl::StatusOr<TriangleMesh> surface_of_file(const sdf::Mesh& mesh, MeshLibrary& meshes);

// The visuals of a link, of which show_visuals() made collisions. Without parts if there are none, or too
// many triangles.
absl::StatusOr<Look> look_of(const sdf::Link& link, MeshLibrary& meshes, Notices& notices);

// All collisions of a link as one shape in the link's frame; without parts if it has none. With `moves`, for
// a movable body, each object of a mesh file becomes the convex hull of its points, or of those of its parts
// if the file asks for them; otherwise it is a surface of triangles. `materials` are those of the collisions,
// with directions in the frame of the link: parts have them if they differ.
absl::StatusOr<Shape> shape_of(const sdf::Link& link, bool moves, const std::vector<PartMaterial>& materials,
                               MeshLibrary& meshes, Notices& notices);

}  // namespace tessera
