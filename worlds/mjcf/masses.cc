#include "worlds/mjcf/masses.h"

#include <absl/strings/str_cat.h>

#include <string>

#include "worlds/loader/inertia.h"

namespace tessera::mjcf {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Mass {
  double mass = 0;
  Vector3d centre = Vector3d::Zero();
  PrincipalInertia inertia{Vector3d::Zero(), Eigen::Quaterniond::Identity()};

  Matrix3d tensor() const {
    const Matrix3d axes = inertia.axes.toRotationMatrix();
    return axes * inertia.moments.asDiagonal() * axes.transpose();
  }
};

Mass mass_of(const mjModel& model, int body, const Pose& pose) {
  const Pose centre = pose * pose_at(model.body_ipos, model.body_iquat, body);
  return {model.body_mass[body],
          centre.position,
          {vector_at(model.body_inertia + 3 * body), centre.orientation.normalized()}};
}

Mass sum_of(const std::vector<Mass>& masses) {
  if (masses.size() == 1) return masses.front();
  Mass sum;
  for (const Mass& one : masses) {
    sum.mass += one.mass;
    sum.centre += one.mass * one.centre;
  }
  if (sum.mass == 0) return sum;
  sum.centre /= sum.mass;
  Matrix3d tensor = Matrix3d::Zero();
  for (const Mass& one : masses) {
    const Vector3d arm = one.centre - sum.centre;
    tensor += one.tensor();
    tensor += one.mass * (arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose());
  }
  sum.inertia = principal_inertia(tensor);
  return sum;
}

}  // namespace

void set_mass(const Model& model, const Members& members, double share, BodyProperties& properties,
              Notices& notices) {
  std::vector<Mass> masses;
  for (const auto& [body, pose] : members) {
    if (model->body_mass[body] > 0) masses.push_back(mass_of(*model, body, pose));
  }
  Mass sum = masses.empty() ? Mass{} : sum_of(masses);
  sum.mass *= share;
  sum.inertia.moments *= share;
  const Matrix3d tensor = sum.tensor();
  MassProperties given{sum.mass, tensor.diagonal(), {tensor(0, 1), tensor(0, 2), tensor(1, 2)}};
  const std::vector<std::string> faults = repair(given);
  for (const std::string& fault : faults) {
    notices.count_repair(
        fault,
        absl::StrCat("<body name='", name_at(*model, model->name_bodyadr, members.front().first), "'>"));
  }
  if (!faults.empty()) {
    Matrix3d mended = given.moments.asDiagonal();
    mended(0, 1) = mended(1, 0) = given.products[0];
    mended(0, 2) = mended(2, 0) = given.products[1];
    mended(1, 2) = mended(2, 1) = given.products[2];
    sum.inertia = principal_inertia(mended);
  }
  properties.mass = given.mass;
  Eigen::Map<Vector3d>(properties.inertia.data()) = sum.inertia.moments;
  Eigen::Map<Vector3d>(properties.centre.data()) = sum.centre;
  Eigen::Map<Eigen::Vector4d>(properties.principal_axes.data()) = sum.inertia.axes.coeffs();
}

}  // namespace tessera::mjcf
