// Bodies, commands and joints that come from another process or a file: what they must fulfil before a
// partition gets them, as far as it does not depend on what other bodies there are.
#pragma once

#include <absl/status/status.h>

#include <functional>
#include <span>
#include <string>
#include <utility>

#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/model/settings.h"
#include "lpss/partition/partition.h"
#include "lpss/partition/world_state.h"
#include "lpss/tick/messages.h"

namespace tessera {

std::string title_of(BodyId id);

// INVALID_ARGUMENT, with the value and its bound.
class RecordChecks {
 public:
  // Null for a shape that the world does not have.
  using FindShape = std::function<const Shape*(ShapeId)>;

  RecordChecks(const WorldSettings& settings, FindShape find_shape)
      : settings_(settings), find_shape_(std::move(find_shape)) {}

  absl::Status id(BodyId id) const;
  absl::Status properties(BodyId id, const BodyProperties& properties) const;

  // Whether the world has its frame.
  absl::Status home(const SectorIndex& home) const;

  // Its position is relative to its home. At the edge of the representable world it may be beyond the last
  // sector, where a body is only stopped as the next tick begins.
  absl::Status state(const BodyState& state) const;

  // Whether a sector is so near to a body's home that a tick may take the body there.
  absl::Status near(const std::string& what, const SectorIndex& home, const SectorIndex& other) const;

  absl::Status record(const BodyRecord& record) const;

  // Whatever its bodies are.
  absl::Status joint(const JointRecord& record) const;

  absl::Status command(const Command& command) const;

  // Of programs, for the next tick.
  absl::Status acts(std::span<const Command> acts) const;

 private:
  absl::Status leaders(const AddJoint& command) const;
  absl::Status drives(const SetDrives& command) const;
  absl::Status radial(const ApplyRadialImpulse& command) const;

  WorldSettings settings_;
  FindShape find_shape_;
};

// Whether a partition can take these, which come from a coordinator: bodies and joints of a load, all that a
// partition goes on from, or the commands of a tick.
absl::Status check(const Partition& partition, std::span<const BodyRecord> records,
                   std::span<const JointRecord> joints);
absl::Status check(const Partition& partition, const SharedState& shared,
                   std::span<const MovedSector> sectors);
absl::Status check(const Partition& partition, std::span<const Command> commands);

}  // namespace tessera
