// Encodes the view of one tab of the web UI as binary frames that contain only changes.
//
// A frame is little-endian: a FrameHeader, then one array after the other, each over all bodies (or
// contacts):
//
//   kBodies    f64 id | f64 id of removed bodies | f32 x y z | f32 x y z w of the orientation | f32 m/s |
//              u8 index of the server | u8 flags:
//              1 for what sleeps, 2 for what is aboard of a frame that moves
//   kContacts  f32 x y z of the point | f32 x y z of the normal | f32 N s
//
// Points are in metres from the centre of the view's sector (page_view.h), along the world's axes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "lpss/model/body.h"

namespace tessera::viewer {

enum class FrameKind : std::uint32_t { kBodies = 1, kContacts = 2 };

inline constexpr std::uint32_t kKeyFrame = 1;  // all earlier frames are void

struct FrameHeader {
  FrameKind kind = FrameKind::kBodies;
  std::uint32_t flags = 0;
  std::uint32_t count = 0;
  std::uint32_t gone = 0;
  std::uint64_t tick = 0;
};
static_assert(sizeof(FrameHeader) == 24);

// How one body is drawn.
struct SeenBody {
  std::uint64_t id = 0;
  std::array<float, 3> position{};     // of the body frame
  std::array<float, 4> orientation{};  // x y z w
  float speed = 0;                     // of the centre of mass, m/s
  std::uint8_t server = 0;             // its index in the list of servers
  bool asleep = false;
  bool aboard = false;  // of another frame than the view's

  friend bool operator==(const SeenBody&, const SeenBody&) = default;
};
static_assert(kBodyIdMax < std::uint64_t{1} << std::numeric_limits<double>::digits);

struct SeenContact {
  std::array<float, 3> position{};
  std::array<float, 3> normal{};
  float impulse = 0;  // N s
};

// The frames of one tab, in order. For one thread at a time.
class FrameEncoder {
 public:
  // The next frame is a key frame.
  void start_over() { started_ = false; }

  // `bodies` are all visible bodies, ascending by id. Empty if nothing has changed.
  std::string encode(std::uint64_t tick, std::vector<SeenBody> bodies);

 private:
  std::vector<SeenBody> shown_;
  bool started_ = false;
};

std::string encode(std::uint64_t tick, std::span<const SeenContact> contacts);

}  // namespace tessera::viewer
