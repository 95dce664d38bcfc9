#include "viewer/page_view.h"

#include <array>
#include <variant>

#include "lpss/model/frame_motion.h"
#include "lpss/model/gravity.h"
#include "viewer/json.h"

namespace tessera::viewer {
namespace {

constexpr std::uint8_t kNoServer = 255;

std::array<float, 3> floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

std::array<float, 4> floats(const Eigen::Quaterniond& q) {
  return {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()),
          static_cast<float>(q.w())};
}

const Plane* plane_of(const Shape& shape) {
  return shape.parts.size() == 1 ? std::get_if<Plane>(&shape.parts.front().geometry) : nullptr;
}

// Moves a body along its plane so that the plane's origin is its point closest to zero.
Eigen::Vector3d slid_to_zero(const Eigen::Vector3d& body, const Eigen::Quaterniond& orientation,
                             const ShapePart& part, const Plane& plane) {
  const Eigen::Vector3d normal = orientation * (part.pose.orientation * plane.normal);
  const Eigen::Vector3d origin = orientation * part.pose.position;
  return normal.dot(body + origin) * normal - origin;
}

}  // namespace

Eigen::Vector3d PageView::offset(const WorldPosition& point) const {
  return relative_to(point, sector(), settings_.sector_size);
}

Interest known_in(const WorldSettings& settings, Interest interest) {
  if (interest.centre.sector.frame > settings.frames.size()) interest.centre.sector.frame = kWorldFrame;
  return interest;
}

Eigen::Vector3d PageView::pull(const WorldPosition& place, double time) const {
  const FrameNumber frame = place.sector.frame;
  if (frame == kWorldFrame)
    return acceleration_at(settings_.gravity, place.sector, place.local, settings_.sector_size);
  const MovingFrame& moving = settings_.frames[frame - 1];
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  if (!moving.falls) {
    const absl::StatusOr<WorldPose> around =
        pose_in_frame(settings_, time, {place}, moving.parent(), carriers_.poses());
    if (!around.ok()) return Eigen::Vector3d::Zero();
    pull = around->orientation.conjugate() * this->pull(around->position, time);
  }
  if (moving.carrier) return pull;
  const FrameMotion motion = motion_at(settings_, moving, time);
  const Eigen::Vector3d spin = motion.orientation.conjugate() * motion.spin;
  return pull - spin.cross(spin.cross(relative_to(place, {0, 0, 0, frame}, settings_.sector_size)));
}

Eigen::Vector3d PageView::up(Tick tick) const {
  constexpr double kPullMin = 1e-3;  // m/s^2
  if (sector().frame != kWorldFrame) {
    const Eigen::Vector3d felt = pull(interest_.centre, static_cast<double>(tick) * settings_.time_step);
    return felt.norm() < kPullMin ? Eigen::Vector3d::UnitZ().eval() : (-felt).stableNormalized().eval();
  }
  const auto* uniform = std::get_if<UniformGravity>(&settings_.gravity);
  const Eigen::Vector3d up =
      (uniform != nullptr ? (-uniform->acceleration).eval() : (interest_.centre.local - *planet(tick)).eval())
          .stableNormalized();
  return up.isZero() ? Eigen::Vector3d::UnitZ().eval() : up;
}

std::optional<Eigen::Vector3d> PageView::planet(Tick tick) const {
  const auto* central = std::get_if<CentralGravity>(&settings_.gravity);
  if (central == nullptr) return std::nullopt;
  return offset(posed({central->centre}, tick).position);
}

nlohmann::json PageView::describe(Tick tick) const {
  nlohmann::json view = {
      {"type", "view"}, {"sector", to_json(sector())}, {"sector_size", settings_.sector_size}};
  if (sector().frame != kWorldFrame) {
    view["frame"] = sector().frame;
    view["frame_name"] = settings_.frames[sector().frame - 1].name;
  }
  view["up"] = to_json(up(tick));
  if (const std::optional<Eigen::Vector3d> centre = planet(tick)) {
    view["planet"] = {{"centre", to_json(*centre)},
                      {"radius", std::get<CentralGravity>(settings_.gravity).radius}};
  }
  return view;
}

// What has no place there is as far away as can be.
WorldPose PageView::posed(const WorldPose& pose, Tick tick) const {
  if (pose.position.sector.frame == sector().frame) return pose;
  return pose_in_frame(settings_, static_cast<double>(tick) * settings_.time_step, pose, sector().frame,
                       carriers_.poses())
      .value_or(pose);
}

void PageView::see_carriers(const BodyFrame& frame) {
  for (const BodySample& body : frame.bodies) carriers_.see(body.id, body.pose);
}

SeenBody PageView::see(const BodySample& body, std::uint8_t server, Tick tick) const {
  const WorldPose pose = posed(body.pose, tick);
  return {body.id.value,
          floats(offset(pose.position)),
          floats(pose.orientation),
          static_cast<float>(body.linear_velocity.norm()),
          server,
          body.asleep,
          body.pose.position.sector.frame != sector().frame};
}

bool PageView::holds(const SeenBody& body) const {
  const Eigen::Vector3d place(body.position[0], body.position[1], body.position[2]);
  return ((place - interest_.centre.local).cwiseAbs().array() <= interest_.half).all();
}

std::vector<SeenBody> PageView::see_statics(const live::BodyCatalogue& catalogue, Tick tick) const {
  std::vector<SeenBody> seen;
  for (const live::StaticBody& body : catalogue.statics()) {
    const BodySample& sample = body.sample;
    const Shape& shape = catalogue.shape(catalogue.find(sample.id)->properties.shape);
    const WorldPose pose = posed(sample.pose, tick);
    const Eigen::Vector3d away = offset(pose.position);
    if (!away.allFinite()) continue;
    if (const Plane* plane = plane_of(shape)) {
      SeenBody& added = seen.emplace_back(see(sample, kNoServer, tick));
      added.position = floats(slid_to_zero(away, pose.orientation, shape.parts.front(), *plane));
    } else if (((away - interest_.centre.local).cwiseAbs().array() <= interest_.half + body.radius).all()) {
      seen.push_back(see(sample, kNoServer, tick));
    }
  }
  return seen;
}

std::vector<SeenContact> PageView::see(const ContactFrame& frame) const {
  std::vector<SeenContact> seen;
  for (const ContactSample& contact : frame.contacts) {
    if (contact.phase == ContactPhase::kEnd || contact.trigger) continue;
    const WorldPose pose = posed({contact.position}, frame.tick);
    const Eigen::Vector3d point = offset(pose.position);
    if (((point - interest_.centre.local).cwiseAbs().array() > interest_.half).any()) continue;
    seen.push_back({floats(point), floats(Eigen::Vector3d(pose.orientation * contact.normal)),
                    static_cast<float>(contact.impulse)});
  }
  return seen;
}

}  // namespace tessera::viewer
