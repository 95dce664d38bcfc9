#include "lpss/model/body.h"

namespace tessera {

const char* name_of(Motion motion) {
  switch (motion) {
    case Motion::kStatic:
      return "static";
    case Motion::kDynamic:
      return "dynamic";
    case Motion::kKinematic:
      break;
  }
  return "kinematic";
}

Eigen::Quaterniond quaternion_of(const BodyState& state) {
  const Eigen::Matrix3d rotation =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(state.rotation.data());
  return Eigen::Quaterniond(rotation).normalized();
}

std::array<double, 9> rotation_of(const Eigen::Quaterniond& q) {
  std::array<double, 9> rows;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data()) = q.normalized().toRotationMatrix();
  return rows;
}

void set_surface_motion(BodyProperties& properties, const std::array<double, 3>& velocity,
                        const std::array<double, 3>& running) {
  Surface surface = properties.surface.value_or(Surface{});
  surface.velocity = velocity;
  surface.running = running;
  properties.surface = surface;
}

Wrench wrench_at(const BodyProperties& properties, const std::array<double, 9>& rotation) {
  const LastingForce& lasting = *properties.lasting;
  if (!lasting.turns_along) return lasting.wrench;
  using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3d turn = Eigen::Map<const Rotation>(rotation.data()) *
                               centre_frame(properties).orientation.toRotationMatrix().transpose();
  Wrench wrench;
  Eigen::Map<Eigen::Vector3d>(wrench.force.data()) =
      turn * Eigen::Map<const Eigen::Vector3d>(lasting.wrench.force.data());
  Eigen::Map<Eigen::Vector3d>(wrench.torque.data()) =
      turn * Eigen::Map<const Eigen::Vector3d>(lasting.wrench.torque.data());
  return wrench;
}

Pose centre_frame(const BodyProperties& properties) {
  return {Eigen::Map<const Eigen::Vector3d>(properties.centre.data()),
          Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(properties.principal_axes.data()))};
}

}  // namespace tessera
