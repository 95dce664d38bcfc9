// The frames that move of tessera/c.h.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "client_sdk/src/c_values.h"
#include "lpss/model/frame_motion.h"

using tessera::c::code_of;
using tessera::c::give;
using tessera::c::position_of;

struct tessera_moving_frames {
  tessera::WorldSettings settings;
  tessera::SeenCarriers carriers;
};

tessera_code tessera_get_moving_frames(tessera_client* client, tessera_moving_frames** frames) {
  const absl::StatusOr<tessera::ClusterStatus> status = client->client->status();
  if (!status.ok()) return code_of(status.status());
  if (!status->settings) return code_of(absl::FailedPreconditionError("no world is loaded"));
  *frames = new tessera_moving_frames{*status->settings, tessera::SeenCarriers(*status->settings)};
  return code_of(absl::OkStatus());
}

void tessera_moving_frames_free(tessera_moving_frames* frames) { delete frames; }

uint32_t tessera_moving_frames_count(const tessera_moving_frames* frames) {
  return static_cast<uint32_t>(frames->settings.frames.size());
}

const char* tessera_moving_frame_name(const tessera_moving_frames* frames, uint32_t frame) {
  if (frame == tessera::kWorldFrame || frame > frames->settings.frames.size()) return nullptr;
  return frames->settings.frames[frame - 1].name.c_str();
}

tessera_code tessera_find_moving_frame(const tessera_moving_frames* frames, const char* name,
                                       uint32_t* frame) {
  const std::vector<tessera::MovingFrame>& all = frames->settings.frames;
  const auto found = std::ranges::find(all, name, &tessera::MovingFrame::name);
  if (found == all.end())
    return code_of(absl::NotFoundError(absl::StrCat("no frame that moves has the name '", name, "'")));
  *frame = static_cast<uint32_t>(found - all.begin() + 1);
  return code_of(absl::OkStatus());
}

void tessera_see_carriers(tessera_moving_frames* frames, const tessera_body* bodies, size_t count) {
  for (const tessera_body* body = bodies; body != bodies + count; ++body) {
    frames->carriers.see(tessera::BodyId{body->id},
                         {position_of(body->position), Eigen::Quaterniond(body->orientation)});
  }
}

tessera_code tessera_pose_in_frame(const tessera_moving_frames* frames, uint64_t tick,
                                   const tessera_position* position, const double orientation[4],
                                   uint32_t frame, tessera_position* position_there,
                                   double orientation_there[4]) {
  tessera::WorldPose pose{position_of(*position)};
  if (orientation != nullptr) pose.orientation = Eigen::Quaterniond(orientation);
  const double time = static_cast<double>(tick) * frames->settings.time_step;
  return give(pose_in_frame(frames->settings, time, pose, frame, frames->carriers.poses()),
              [&](const tessera::WorldPose& there) {
                *position_there = tessera::c::position_for_c(there.position);
                if (orientation_there != nullptr)
                  std::copy_n(there.orientation.coeffs().data(), 4, orientation_there);
              });
}
