// Where bodies are, in double precision, whatever the engine computes with.
#pragma once

#include <Eigen/Core>

#include "lpss/collision/ray.h"
#include "lpss/native/body.h"

namespace tessera::native {

// Maps a frame to another, as Frame.
struct ExactFrame {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d position;

  explicit ExactFrame(const Frame& f)
      : rotation(f.rotation.cast<double>()), position(f.position.cast<double>()) {}

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + position; }
  Eigen::Vector3d inverse(const Eigen::Vector3d& point) const {
    return rotation.transpose() * (point - position);
  }
  collision::Ray inverse(const collision::Ray& ray) const {
    return {inverse(ray.from), rotation.transpose() * ray.way, ray.first, ray.last};
  }
};

// The pose of a body's solid. The numbers of the engine are a static body's own, rounded.
ExactFrame exact_frame_of(const Body& body);

// Likewise of another solid that the body has (Sensor).
ExactFrame exact_frame_of(const Body& body, const Solid& solid);

// Of a part of it.
inline ExactFrame operator*(const ExactFrame& outer, const ExactFrame& inner) {
  ExactFrame frame = outer;
  frame.position = outer * inner.position;
  frame.rotation = outer.rotation * inner.rotation;
  return frame;
}

}  // namespace tessera::native
