// Values of the SDK that are worked out from what a cluster tells.
#include <absl/strings/str_cat.h>

#include "tessera/client.h"

namespace tessera {
namespace {

std::string named(const char* what, const std::string& name, std::uint64_t id) {
  return name.empty() ? absl::StrCat(what, " ", id) : absl::StrCat(what, " '", name, "'");
}

}  // namespace

WorldPose frame_pose(const FoundFrame& frame, const BodySample& body, double sector_size) {
  const absl::StatusOr<WorldPose> pose = compose(body.pose, frame.pose, sector_size);
  if (pose.ok()) return *pose;
  const Pose local = Pose{body.pose.position.local, body.pose.orientation} * frame.pose;
  return {{body.pose.position.sector, local.position}, local.orientation};
}

std::string to_text(const NamedDivergence& divergence) {
  std::string text = absl::StrCat(named("body", divergence.body_name, divergence.body.value), " at tick ",
                                  divergence.tick, ": ", name_of(divergence.kind));
  if (divergence.joint.value != 0)
    absl::StrAppend(&text, ", ", named("joint", divergence.joint_name, divergence.joint.value));
  return text;
}

}  // namespace tessera
