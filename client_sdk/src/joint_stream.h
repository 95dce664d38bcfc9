// Positions of joints, computed from a stream of their bodies.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "tessera/joints.h"

namespace tessera {

// The bodies that determine the coordinates of `joints`, ascending.
std::vector<BodyId> bodies_of(const std::vector<FoundJoint>& joints);

// The joints at the tick of a frame with their bodies, in the same order; joints with missing bodies are left
// out.
JointFrame joints_in(const BodyFrame& bodies, const std::vector<FoundJoint>& joints, double sector_size);

class JointsOfBodies final : public JointStream {
 public:
  // `bodies` streams bodies_of(joints).
  JointsOfBodies(std::unique_ptr<BodyStream> bodies, std::vector<FoundJoint> joints, double sector_size)
      : bodies_(std::move(bodies)), joints_(std::move(joints)), sector_size_(sector_size) {}

  absl::StatusOr<JointFrame> next(absl::Duration timeout) override {
    const absl::StatusOr<BodyFrame> frame = bodies_->next(timeout);
    if (!frame.ok()) return frame.status();
    return joints_in(*frame, joints_, sector_size_);
  }
  void cancel() override { bodies_->cancel(); }
  std::uint64_t skipped() const override { return bodies_->skipped(); }

 private:
  std::unique_ptr<BodyStream> bodies_;
  std::vector<FoundJoint> joints_;
  double sector_size_;
};

}  // namespace tessera
