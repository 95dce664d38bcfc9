#include "worlds/loader/inertia.h"

#include <absl/strings/str_cat.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <ignition/math/Box.hh>
#include <ignition/math/Capsule.hh>
#include <ignition/math/Cylinder.hh>
#include <ignition/math/Ellipsoid.hh>
#include <ignition/math/Sphere.hh>
#include <ignition/math/eigen3/Conversions.hh>
#include <numbers>
#include <optional>
#include <sdf/Box.hh>
#include <sdf/Capsule.hh>
#include <sdf/Collision.hh>
#include <sdf/Cylinder.hh>
#include <sdf/Element.hh>
#include <sdf/Ellipsoid.hh>
#include <sdf/Geometry.hh>
#include <sdf/Mesh.hh>
#include <sdf/Sphere.hh>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "worlds/loader/given_geometry.h"
#include "worlds/loader/surface_reader.h"

namespace tessera {
namespace {

namespace im = ignition::math;

constexpr double kDensityDefault = 1000;  // kg/m^3, SDF's

std::optional<im::MassMatrix3d> mass_matrix(const sdf::Geometry& geometry, double density) {
  const im::Material material(density);
  im::MassMatrix3d result;
  switch (geometry.Type()) {
    case sdf::GeometryType::BOX: {
      const im::Boxd box(geometry.BoxShape()->Size(), material);
      return box.MassMatrix(result) ? std::optional(result) : std::nullopt;
    }
    case sdf::GeometryType::SPHERE: {
      const im::Sphered sphere(geometry.SphereShape()->Radius(), material);
      return sphere.MassMatrix(result) ? std::optional(result) : std::nullopt;
    }
    case sdf::GeometryType::CYLINDER: {
      const sdf::Cylinder& shape = *geometry.CylinderShape();
      const im::Cylinderd cylinder(shape.Length(), shape.Radius(), material);
      return cylinder.MassMatrix(result) ? std::optional(result) : std::nullopt;
    }
    case sdf::GeometryType::CAPSULE: {
      const sdf::Capsule& shape = *geometry.CapsuleShape();
      return im::Capsuled(shape.Length(), shape.Radius(), material).MassMatrix();
    }
    case sdf::GeometryType::ELLIPSOID:
      return im::Ellipsoidd(geometry.EllipsoidShape()->Radii(), material).MassMatrix();
    default:
      return std::nullopt;
  }
}

// The areas of a closed surface, as vectors, add up to 0: those of one that misses this share of its area
// are taken as closed.
constexpr double kOpenShareMax = 1e-3;

bool is_closed(const std::vector<TriangleMesh>& surfaces) {
  double area = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const TriangleMesh& mesh : surfaces) {
    for (std::size_t n = 0; n < mesh.indices.size(); n += 3) {
      const Eigen::Vector3d& a = mesh.vertices[mesh.indices[n]];
      const Eigen::Vector3d part =
          (mesh.vertices[mesh.indices[n + 1]] - a).cross(mesh.vertices[mesh.indices[n + 2]] - a);
      area += part.norm();
      sum += part;
    }
  }
  return sum.norm() <= kOpenShareMax * area;
}

// Of a solid within closed surfaces, by the tetrahedra between their triangles and the origin. They may be
// inside out. None for surfaces that are not closed.
std::optional<im::Inertiald> inertia_within(const std::vector<TriangleMesh>& surfaces, double density) {
  if (!is_closed(surfaces)) return std::nullopt;
  double volume = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  // moments of the volume
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const TriangleMesh& mesh : surfaces) {
    for (std::size_t n = 0; n < mesh.indices.size(); n += 3) {
      const Eigen::Vector3d& a = mesh.vertices[mesh.indices[n]];
      const Eigen::Vector3d& b = mesh.vertices[mesh.indices[n + 1]];
      const Eigen::Vector3d& c = mesh.vertices[mesh.indices[n + 2]];
      const double part = a.dot(b.cross(c)) / 6;
      const Eigen::Vector3d sum = a + b + c;
      volume += part;
      first += sum * (part / 4);
      second +=
          (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose()) * (part / 20);
    }
  }
  if (volume < 0) {
    volume = -volume;
    first = -first;
    second = -second;
  }
  if (!(volume > 0)) return std::nullopt;
  const Eigen::Vector3d centre = first / volume;
  second -= centre * centre.transpose() * volume;
  const Eigen::Matrix3d tensor = (Eigen::Matrix3d::Identity() * second.trace() - second) * density;
  const im::MassMatrix3d matrix(volume * density, {tensor(0, 0), tensor(1, 1), tensor(2, 2)},
                                {tensor(0, 1), tensor(0, 2), tensor(1, 2)});
  return im::Inertiald(matrix, {im::eigen3::convert(centre), im::Quaterniond::Identity});
}

absl::StatusOr<std::optional<im::Inertiald>> inertia_of(const sdf::Geometry& geometry, double density,
                                                        MeshLibrary& meshes) {
  if (geometry.Type() != sdf::GeometryType::MESH) {
    const std::optional<im::MassMatrix3d> matrix = mass_matrix(geometry, density);
    return matrix ? std::optional(im::Inertiald(*matrix, im::Pose3d::Zero)) : std::nullopt;
  }
  const sdf::Mesh& mesh = *geometry.MeshShape();
  const GivenGeometry* const given = meshes.given(mesh.Uri());
  if (given == nullptr || std::holds_alternative<DividedMesh>(*given)) {
    absl::StatusOr<TriangleMesh> surface = surface_of_file(mesh, meshes);
    if (!surface.ok()) return surface.status();
    return inertia_within({*std::move(surface)}, density);
  }
  const absl::StatusOr<std::vector<TriangleMesh>> surfaces = surfaces_of(*given);
  return surfaces.ok() ? inertia_within(*surfaces, density) : std::nullopt;
}

double density_of(const sdf::Collision& collision) {
  const sdf::ElementPtr element = collision.Element();
  if (!element->HasElement("tessera:density")) return kDensityDefault;
  return element->GetElement("tessera:density")->Get<double>();
}

// Less, as a fraction of the largest moment, is a slip of the pen: a rod 400 times as long as thick has more.
constexpr double kRatioOfRods = 1e-5;
// The least second moment of mass that a repair leaves, as a fraction of the largest. Links of joints whose
// shape is far thicker than their moments diverge, in f32 and f64, from a tenth of that.
constexpr double kSpreadMin = 1e-3;

Eigen::Matrix3d tensor_of(const MassProperties& properties) {
  const Eigen::Vector3d& products = properties.products;
  Eigen::Matrix3d tensor = properties.moments.asDiagonal();
  tensor(0, 1) = tensor(1, 0) = products[0];
  tensor(0, 2) = tensor(2, 0) = products[1];
  tensor(1, 2) = tensor(2, 1) = products[2];
  return tensor;
}

// Whether libsdformat takes a tensor for that of a body.
bool is_valid(const Eigen::Matrix3d& tensor) {
  const im::Vector3d moments(tensor(0, 0), tensor(1, 1), tensor(2, 2));
  const im::Vector3d products(tensor(0, 1), tensor(0, 2), tensor(1, 2));
  return im::MassMatrix3d(1, moments, products).IsValid();
}

// Of a ball of water of this mass: kg m^2.
double moment_of_water(double mass) {
  constexpr double kWater = 1000;  // kg/m^3
  const double radius = portable::pow(3 * mass / (4 * std::numbers::pi * kWater), 1.0 / 3);
  return 2 * mass * radius * radius / 5;
}

// Moments that are all a smaller share of those of water are rounding errors of a 0: a ball that has them is
// 10^9 times as dense as water.
constexpr double kShareOfWaterMin = 1e-6;

bool has_no_moments(const Eigen::Vector3d& principal, double mass) {
  return !(principal.maxCoeff() > kShareOfWaterMin * moment_of_water(mass));
}

// What is wrong with a tensor, or nullptr.
const char* fault_of(const Eigen::Matrix3d& tensor, const Eigen::Vector3d& principal, double mass) {
  const double largest = principal.maxCoeff();
  if (has_no_moments(principal, mass))
    return "moments of inertia of 0 or next to it, taken as those of a ball of water of the same mass";
  if (principal.minCoeff() <= 0) return "moment of inertia of 0 or less, raised to what the others allow";
  if (!is_valid(tensor)) {
    return "moment of inertia larger than the other two together (triangle inequality), these two raised";
  }
  if (principal.minCoeff() < std::max(kInertiaMin, kRatioOfRods * largest)) {
    return "moment of inertia too small beside the others, raised";
  }
  return nullptr;
}

Eigen::Vector3d nearest_moments(const Eigen::Vector3d& principal, double mass) {
  Eigen::Vector3d spread = Eigen::Vector3d::Constant(principal.sum() / 2) - principal;
  if (has_no_moments(principal, mass)) spread.setConstant(moment_of_water(mass) / 2);
  const double least = std::max(kSpreadMin * spread.maxCoeff(), kInertiaMin);
  spread = spread.cwiseMax(least);
  return Eigen::Vector3d::Constant(spread.sum()) - spread;
}

// Of the densities of the file, or of this one (kg/m^3).
absl::StatusOr<im::Inertiald> sum_of_collisions(const sdf::Link& link, std::optional<double> density,
                                                MeshLibrary& meshes) {
  std::optional<im::Inertiald> sum;
  for (std::uint64_t n = 0; n < link.CollisionCount(); ++n) {
    const sdf::Collision& collision = *link.CollisionByIndex(n);
    if (is_trigger(collision)) continue;
    const absl::StatusOr<std::optional<im::Inertiald>> of_shape =
        inertia_of(*collision.Geom(), density.value_or(density_of(collision)), meshes);
    if (!of_shape.ok()) return of_shape.status();
    if (!of_shape->has_value()) {
      return absl::InvalidArgumentError(absl::StrCat("<inertial auto='true'>: collision '", collision.Name(),
                                                     "' has no volume: its surface is not closed"));
    }
    const im::Inertiald& own = **of_shape;
    im::Pose3d pose;
    if (!collision.SemanticPose().Resolve(pose, "__link__").empty()) pose = collision.RawPose();
    const im::Inertiald part(own.MassMatrix(), pose * own.Pose());
    sum = sum ? *sum + part : part;
  }
  if (!sum)
    return absl::InvalidArgumentError("<inertial auto='true'>: there is no collision to take it from");
  return *sum;
}

}  // namespace

PrincipalInertia principal_inertia(const Eigen::Matrix3d& tensor) {
  constexpr double kDiagonalTolerance = 1e-9;
  const double off = std::max({std::abs(tensor(0, 1)), std::abs(tensor(0, 2)), std::abs(tensor(1, 2))});
  if (!(off > kDiagonalTolerance * tensor.diagonal().cwiseAbs().maxCoeff())) {
    return {tensor.diagonal(), Eigen::Quaterniond::Identity()};
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(tensor);
  Eigen::Matrix3d axes = solver.eigenvectors();
  // An eigenvector's sign is free: choose it, so that the axes follow from the tensor alone.
  for (int column = 0; column < 2; ++column) {
    Eigen::Index largest = 0;
    axes.col(column).cwiseAbs().maxCoeff(&largest);
    if (axes(largest, column) < 0) axes.col(column) *= -1;
  }
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return {solver.eigenvalues(), Eigen::Quaterniond(axes).normalized()};
}

std::vector<std::string> repair(MassProperties& properties) {
  std::vector<std::string> faults;
  double& mass = properties.mass;
  if (mass == 0) return faults;
  Eigen::Matrix3d tensor = tensor_of(properties);
  if (mass < kMassMin) {
    faults.push_back(absl::StrCat("mass below ", kMassMin, " kg, raised to it"));
    tensor *= kMassMin / mass;
    mass = kMassMin;
  }
  const PrincipalInertia principal = principal_inertia(tensor);
  const char* fault = fault_of(tensor, principal.moments, mass);
  if (fault == nullptr && faults.empty()) return faults;
  if (fault != nullptr) {
    faults.emplace_back(fault);
    const Eigen::Matrix3d axes = principal.axes.toRotationMatrix();
    tensor = axes * nearest_moments(principal.moments, mass).asDiagonal() * axes.transpose();
  }
  properties.moments = tensor.diagonal();
  properties.products = {tensor(0, 1), tensor(0, 2), tensor(1, 2)};
  return faults;
}

void set_inertia(const im::Inertiald& inertial, BodyProperties& properties) {
  const im::Matrix3d moi = inertial.MassMatrix().Moi();
  Eigen::Matrix3d tensor;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) tensor(row, column) = moi(row, column);
  }
  const PrincipalInertia principal = principal_inertia(tensor);
  const Eigen::Vector3d centre = im::eigen3::convert(inertial.Pose().Pos());
  const Eigen::Quaterniond axes =
      (im::eigen3::convert(inertial.Pose().Rot()).normalized() * principal.axes).normalized();
  properties.mass = inertial.MassMatrix().Mass();
  properties.inertia = {principal.moments.x(), principal.moments.y(), principal.moments.z()};
  properties.centre = {centre.x(), centre.y(), centre.z()};
  properties.principal_axes = {axes.x(), axes.y(), axes.z(), axes.w()};
}

absl::StatusOr<im::Inertiald> inertia_of_collisions(const sdf::Link& link, MeshLibrary& meshes) {
  return sum_of_collisions(link, std::nullopt, meshes);
}

std::optional<Displacement> displacement_of_collisions(const sdf::Link& link, MeshLibrary& meshes) {
  // Of water of 1 kg/m^3.
  const absl::StatusOr<im::Inertiald> sum = sum_of_collisions(link, 1, meshes);
  if (!sum.ok()) return std::nullopt;
  const double volume = sum->MassMatrix().Mass();
  const im::Vector3d moments = sum->MassMatrix().DiagonalMoments();
  // For a box, of volume V: moments V (b^2 + c^2) / 12, and so on.
  const double half = (moments.X() + moments.Y() + moments.Z()) / 2;
  Eigen::Vector3d size;
  for (const int axis : {0, 1, 2}) {
    const double second = std::max(half - moments[static_cast<std::size_t>(axis)], 0.0);
    size[axis] = std::sqrt(12 * second / volume);
  }
  if (!(volume > 0) || !(size.minCoeff() > 0)) return std::nullopt;
  size *= portable::pow(volume / size.prod(), 1.0 / 3);
  return Displacement{im::eigen3::convert(sum->Pose().Pos()), size};
}

}  // namespace tessera
