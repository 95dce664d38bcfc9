#include "lpss/native/exact_frame.h"

namespace tessera::native {

ExactFrame exact_frame_of(const Body& body) { return exact_frame_of(body, *body.solid); }

ExactFrame exact_frame_of(const Body& body, const Solid& solid) {
  ExactFrame frame(body.pose);
  if (body.static_state) {
    const Eigen::Matrix3d rotation =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(body.static_state->rotation.data());
    const ExactFrame offset(solid.offset());
    frame.rotation = rotation * offset.rotation;
    frame.position = Eigen::Vector3d(body.static_state->position.data()) + rotation * offset.position;
  } else if (body.fine) {
    frame.position = body.fine->position;
  }
  return frame;
}

}  // namespace tessera::native
