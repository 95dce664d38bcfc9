// Elementary checks for validation: each returns OK, or INVALID_ARGUMENT with the value and its bound.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "lpss/base/utf8.h"
#include "lpss/model/limits.h"

namespace tessera {

template <typename... Args>
absl::Status refused(const Args&... args) {
  return absl::InvalidArgumentError(absl::StrCat(args...));
}

// The same status, with the subject in front of its message.
inline absl::Status in(const std::string& what, const absl::Status& status) {
  if (status.ok()) return status;
  return absl::Status(status.code(), absl::StrCat(what, ": ", status.message()));
}

// A finite value in [least, most], or a message with the value, its unit and the bound that it violates.
inline absl::Status bounded(absl::string_view what, double value, double least, double most,
                            absl::string_view unit = "") {
  if (!std::isfinite(value)) return refused(what, " = ", value, " must be finite");
  const absl::string_view space = unit.empty() ? "" : " ";
  if (value < least)
    return refused(what, " = ", value, space, unit, " must be at least ", least, space, unit);
  if (value > most) return refused(what, " = ", value, space, unit, " must be at most ", most, space, unit);
  return absl::OkStatus();
}

inline absl::Status finite(const std::string& what, const Eigen::Vector3d& value, double norm_max = kNoBound,
                           absl::string_view unit = "") {
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(value[axis])) {
      return refused(what, " ", std::string(1, "xyz"[axis]), " = ", value[axis], " must be finite");
    }
  }
  const double norm = value.norm();
  if (norm > norm_max) return refused(what, " = ", norm, " ", unit, " must be at most ", norm_max, " ", unit);
  return absl::OkStatus();
}

// Items in ascending order of their keys, each once.
template <typename Items, typename Key>
absl::Status ascend(const std::string& what, const Items& items, const Key& key) {
  const auto not_before = [&](const auto& a, const auto& b) { return !(key(a) < key(b)); };
  if (std::adjacent_find(items.begin(), items.end(), not_before) == items.end()) return absl::OkStatus();
  return refused(what, " must ascend, each once");
}

inline absl::Status sized(const std::string& what, absl::string_view bytes, std::size_t most) {
  if (bytes.size() <= most) return absl::OkStatus();
  return refused(what, ": ", bytes.size(), " bytes must be at most ", most);
}

inline absl::Status utf8(const std::string& what, absl::string_view name) {
  if (is_utf8(name)) return absl::OkStatus();
  return refused(what, " '", absl::CHexEscape(name), "': the name must be UTF-8");
}

inline absl::Status unit_quaternion(const std::string& what, const Eigen::Quaterniond& q) {
  const double norm = q.coeffs().norm();
  if (std::isfinite(norm) && std::abs(norm - 1) <= kQuaternionNormTolerance) return absl::OkStatus();
  return refused(what, ": the quaternion's norm ", norm, " must be 1 within ", kQuaternionNormTolerance);
}

}  // namespace tessera
