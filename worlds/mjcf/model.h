// An MJCF file as MuJoCo has compiled it.
#pragma once

#include <absl/status/statusor.h>
#include <mujoco/mjmodel.h>

#include <Eigen/Core>
#include <map>
#include <memory>
#include <string>

#include "lpss/base/pose.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"
#include "worlds/mjcf/compiler.h"

namespace tessera::mjcf {

struct Model {
  const mjModel& operator*() const { return *its; }
  const mjModel* operator->() const { return its.get(); }

  std::unique_ptr<mjModel, Delete*> its;
  std::string name;                       // empty: the file gives none
  std::map<std::string, double> efforts;  // Document::efforts()
  bool has_time_step = false;             // Document::has_time_step()
};

// `file` is changed. FAILED_PRECONDITION where MuJoCo is not installed, or was not when this was configured;
// INVALID_ARGUMENT with what MuJoCo says, and where.
absl::StatusOr<Model> compile(xml::File& file, Notices& notices);

inline Eigen::Vector3d vector_at(const mjtNum* numbers) { return Eigen::Vector3d(numbers); }
inline Eigen::Quaterniond quaternion_at(const mjtNum* wxyz) {
  return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
}
// Of the n-th of a list of positions and rotations.
inline Pose pose_at(const mjtNum* positions, const mjtNum* rotations, int n) {
  return {vector_at(positions + 3 * n), quaternion_at(rotations + 4 * n)};
}

// That of the n-th object, by one of the lists of places of names; may be empty.
inline std::string name_at(const mjModel& model, const int* places, int n) { return model.names + places[n]; }

}  // namespace tessera::mjcf
