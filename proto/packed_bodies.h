// States of bodies in few bytes, with a stated error: PackedBodies in tessera.proto.
//
// A position is a whole number of quanta of 2 p / sqrt(3) for each axis, from the centre of its sector; so it
// is at most p (m) away from where the body is. An orientation is the three smallest components of its unit
// quaternion, with quanta of a / 4, where a = min(p, 0.1): the fourth is at least 1/2, so the quaternion is
// off by at most twice the error of the three, sqrt(3) a / 4, and the angle by at most a (rad). A body 1 m in
// size has then no point that is off by more than about 2 p.
//
// Of a body that was told before in the same sector, the numbers are differences to what they would be if
// they had gone on as between the last two times. Numbers are varints of 7 bits a byte, those with signs
// zigzag. A body is
//
//   its id, less that of the body before it in the batch
//   flags: 1 asleep; 2 its position, 4 its orientation are differences; 8 and 16 the place of the largest
//     component (x y z w); 32 it has velocities
//   its sector's place in `sectors`, unless its position is a difference
//   position (3), orientation (3), and linear (3) and angular velocity (3) if it has them
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "proto/body_columns.h"
#include "tessera.pb.h"

namespace tessera {

inline constexpr double kPrecisionMin = 1e-6;  // m, and m/s
inline constexpr double kPrecisionMax = 1;     // m
inline constexpr double kVelocityPrecisionMax = 1000;

struct PackedPrecision {
  double position = 1e-3;  // m
  double velocity = 0;     // m/s and rad/s; 0: velocities are left out
};

// INVALID_ARGUMENT, naming the field and the bound.
absl::Status check(const PackedPrecision& precision);

// What both ends of a call know of the bodies that were told.
class PackedHistory {
 public:
  using Numbers = std::array<std::int64_t, 3>;

  // Numbers that are expected to go on as they did.
  class Course {
   public:
    Numbers expected() const { return {now_[0] + step_[0], now_[1] + step_[1], now_[2] + step_[2]}; }
    void begin(const Numbers& now) {
      now_ = now;
      step_ = {};
    }
    void go_on(const Numbers& next) {
      for (int axis = 0; axis < 3; ++axis) step_[axis] = next[axis] - now_[axis];
      now_ = next;
    }

   private:
    Numbers now_{};
    Numbers step_{};
  };
  struct Last {
    SectorIndex sector;
    Course position;
    Course orientation;
    int largest = -1;  // -1: none was told
  };

  explicit PackedHistory(const PackedPrecision& precision);

  // The body is gone, or all are.
  void forget(BodyId id) { last_.erase(id); }
  void clear() { last_.clear(); }

 protected:
  double quantum_ = 0;   // m
  double turn_ = 0;      // of components of a quaternion
  double velocity_ = 0;  // m/s and rad/s
  absl::flat_hash_map<BodyId, Last> last_;
};

class BodyPacker : public PackedHistory {
 public:
  using PackedHistory::PackedHistory;

  // Begins a batch.
  void begin() {
    places_.clear();
    last_id_ = 0;
  }
  // Bodies of a batch ascend by id.
  void add(const BodyRow& body, v1::PackedBodies& packed);

 private:
  absl::flat_hash_map<SectorIndex, std::uint64_t> places_;
  std::uint64_t last_id_ = 0;
};

class BodyUnpacker : public PackedHistory {
 public:
  using PackedHistory::PackedHistory;

  // All batches of a call, in their order. DATA_LOSS where it is no batch that can follow the last one.
  absl::Status read(const v1::PackedBodies& packed, const std::function<void(const BodyRow&)>& visit);
};

}  // namespace tessera
