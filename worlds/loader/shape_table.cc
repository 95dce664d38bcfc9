#include "worlds/loader/shape_table.h"

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

namespace tessera {
namespace {

// Appends the bytes of plain values to a key.
class Bytes {
 public:
  template <typename T>
  requires std::is_arithmetic_v<T>
  void operator()(T value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    bytes_.append(bytes, sizeof value);
  }
  void operator()(const Eigen::Vector3d& v) {
    for (double x : {v.x(), v.y(), v.z()}) (*this)(x);
  }
  void operator()(const Eigen::Quaterniond& q) {
    for (double x : {q.x(), q.y(), q.z(), q.w()}) (*this)(x);
  }
  template <typename T>
  void operator()(const std::vector<T>& values) {
    (*this)(values.size());
    for (const T& value : values) (*this)(value);
  }
  void operator()(const Box& box) { (*this)(box.size); }
  void operator()(const Sphere& sphere) { (*this)(sphere.radius); }
  void operator()(const Capsule& capsule) { both(capsule.radius, capsule.length); }
  void operator()(const Cylinder& cylinder) { both(cylinder.radius, cylinder.length); }
  void operator()(const Ellipsoid& ellipsoid) { (*this)(ellipsoid.radii); }
  void operator()(const Plane& plane) { (*this)(plane.normal); }
  void operator()(const ConvexHull& hull) { (*this)(hull.points); }
  void operator()(const TriangleMesh& mesh) {
    (*this)(mesh.vertices);
    (*this)(mesh.indices);
  }
  void operator()(const HeightField& field) {
    both(field.columns, field.rows);
    both(field.spacing.x(), field.spacing.y());
    (*this)(field.heights);
  }
  void operator()(const PartMaterial& material) {
    both(material.friction, material.restitution);
    both(material.category, material.mask);
    (*this)(material.trigger);
    const Surface& own = material.surface;
    (*this)(Eigen::Vector3d(own.direction.data()));
    both(own.second_friction, own.torsional_friction);
    both(own.patch_radius, own.rolling_friction);
  }
  void operator()(const Ground& ground) {
    both(static_cast<int>(ground.source), static_cast<int>(ground.has_sea));
    for (const double value :
         {ground.spacing, ground.radius, ground.height, ground.wavelength, ground.edge, ground.low})
      (*this)(value);
    (*this)(ground.octaves);
    (*this)(ground.seed);
    (*this)(ground.checksum);
    (*this)(ground.folder.size());
    bytes_ += ground.folder;
  }

  std::string take() { return std::move(bytes_); }

 private:
  template <typename T>
  void both(T a, T b) {
    (*this)(a);
    (*this)(b);
  }

  std::string bytes_;
};

std::string key_of(const Shape& shape) {
  Bytes bytes;
  for (const ShapePart& part : shape.parts) {
    bytes(part.geometry.index());
    std::visit(bytes, part.geometry);
    bytes(part.pose.position);
    bytes(part.pose.orientation);
    if (part.material) bytes(*part.material);
  }
  return bytes.take();
}

}  // namespace

ShapeId ShapeTable::add(Shape shape) {
  const auto [place, added] = places_.try_emplace(key_of(shape), static_cast<ShapeId>(shapes_.size()));
  if (added) shapes_.push_back(std::move(shape));
  return place->second;
}

}  // namespace tessera
