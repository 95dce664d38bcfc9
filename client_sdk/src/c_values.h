// What the calls of tessera/c.h share: values for C, codes of statuses.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/time/time.h>

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <memory>
#include <utility>

#include "tessera/c.h"
#include "tessera/client.h"

struct tessera_client {
  std::unique_ptr<tessera::Client> client;
  // Batches that were sent and have no answer; the client's thread counts them down until it ends.
  std::shared_ptr<std::atomic<int>> pending = std::make_shared<std::atomic<int>>(0);
};

namespace tessera::c {

// Keeps the message for tessera_error_message().
tessera_code code_of(const absl::Status& status);

// Returns the code, and passes on the result if that is OK.
template <typename T, typename Give>
tessera_code give(absl::StatusOr<T> result, Give use) {
  const tessera_code code = code_of(result.status());
  if (result.ok()) use(*std::move(result));
  return code;
}

inline absl::Duration duration_of(double seconds) {
  return seconds < 0 ? absl::InfiniteDuration() : absl::Seconds(seconds);
}

inline void write(const Eigen::Vector3d& vector, double* to) { std::copy_n(vector.data(), 3, to); }

inline WorldPosition position_of(const tessera_position& position) {
  const int64_t* sector = position.sector;
  return {{sector[0], sector[1], sector[2], position.frame}, Eigen::Vector3d(position.local)};
}

inline tessera_position position_for_c(const WorldPosition& position) {
  const SectorIndex& sector = position.sector;
  tessera_position result{{sector.i, sector.j, sector.k}, {}, sector.frame};
  write(position.local, result.local);
  return result;
}

inline tessera_body body_for_c(const BodySample& body) {
  tessera_body result{};
  result.id = body.id.value;
  result.position = position_for_c(body.pose.position);
  std::copy_n(body.pose.orientation.coeffs().data(), 4, result.orientation);
  write(body.linear_velocity, result.linear_velocity);
  write(body.angular_velocity, result.angular_velocity);
  result.asleep = body.asleep;
  return result;
}

}  // namespace tessera::c
