#include "experiments/truth/course.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <variant>

#include "lpss/base/invariant.h"
#include "lpss/model/gravity.h"
#include "lpss/programs/registry.h"
#include "lpss/simulation/simulation.h"

namespace tessera::truth {

Course::Course(const WorldDescription& world, Tick every) : world_(world), every_(every) {
  for (const BodyDescription& body : world_.bodies) ids_.emplace(body.name, BodyId{ids_.size() + 1});
  invariant(ids_.size() == world_.bodies.size(), "bodies have names of their own");
}

BodyId Course::id(const std::string& body) const {
  const auto found = ids_.find(body);
  invariant(found != ids_.end(), "a scene names bodies that its world has");
  return found->second;
}

const Glance& Course::at(const std::string& body, double seconds) const {
  const std::vector<Glance>& glances = of(body);
  const double sample = std::round(seconds / dt() / static_cast<double>(every_));
  return glances[static_cast<std::size_t>(std::clamp(sample, 0.0, static_cast<double>(glances.size() - 1)))];
}

std::span<const Glance> Course::between(const std::string& body, double from, double to) const {
  const std::vector<Glance>& glances = of(body);
  const double step = dt() * static_cast<double>(every_);
  const auto count = static_cast<double>(glances.size());
  const auto begin = static_cast<std::size_t>(std::clamp(std::ceil(from / step - 1e-6), 0.0, count - 1));
  const auto end = static_cast<std::size_t>(std::clamp(std::floor(to / step + 1e-6) + 1, 1.0, count));
  return std::span(glances).subspan(begin, end > begin ? end - begin : 0);
}

double Course::published(const std::string& body, const std::string& value) const {
  for (const ProgramRecord& record : programs_.at(id(body))) {
    const std::optional<std::uint32_t> place = place_of(value, find_program(record.kind)->values());
    if (place) return record.values[*place];
  }
  invariant(false, "a scene names values that programs of its bodies publish");
  return 0;
}

void Course::look(const std::vector<BodyRecord>& bodies) {
  for (const BodyRecord& record : bodies) {
    const WorldPose pose = body_pose(record, world_.settings.sector_size);
    Glance glance;
    glance.place = relative_to(pose.position, anchor_for(pose.position.sector, world_.anchor),
                               world_.settings.sector_size);
    glance.turn = pose.orientation;
    glance.velocity = Eigen::Vector3d(record.state.linear_velocity.data());
    glance.spin = Eigen::Vector3d(record.state.angular_velocity.data());
    glance.asleep = record.state.activity == Activity::kAsleep;
    glances_[record.id].push_back(glance);
    if (!record.programs.empty()) programs_[record.id] = record.programs;
  }
}

void Course::end_tick(const LocalWorld& local, bool keeps_contacts) {
  ++ticks_;
  diverged_ += local.diverged();
  if (ticks_ % every_ == 0) look(local.bodies());
  if (keeps_contacts) contacts_.push_back(local.contacts());
}

void run(LocalWorld& local, double seconds, const Script& script, Course& course, bool keeps_contacts) {
  local.gather_contacts(keeps_contacts);
  if (course.ticks() == 0) course.look(local.bodies());
  const auto end = course.ticks() + static_cast<Tick>(std::llround(seconds / course.dt()));
  while (course.ticks() < end) {
    local.step(script ? script(course) : std::vector<Command>());
    course.end_tick(local, keeps_contacts);
  }
}

Command move_to(const Course& course, const std::string& body, const Eigen::Vector3d& place,
                const Eigen::Quaterniond& turn) {
  const WorldDescription& world = course.world();
  const BodyId id = course.id(body);
  const absl::StatusOr<WorldPosition> position = canonical(world.anchor, place, world.settings.sector_size);
  invariant(position.ok(), "a scene stays near the anchor");
  const absl::StatusOr<WorldPose> centre = compose(
      {*position, turn}, centre_frame(world.bodies[id.value - 1].properties), world.settings.sector_size);
  invariant(centre.ok(), "a scene stays near the anchor");
  KinematicTarget target{id, centre->position.sector, {}};
  Eigen::Map<Eigen::Vector3d>(target.state.position.data()) = centre->position.local;
  target.state.rotation = rotation_of(centre->orientation);
  return target;
}

double way(const Course& course, const std::string& body, double from, double to) {
  const std::span<const Glance> glances = course.between(body, from, to);
  double farthest = 0;
  for (const Glance& glance : glances)
    farthest = std::max(farthest, (glance.place - glances.front().place).norm());
  return farthest;
}

double energy(const Course& course, std::size_t sample) {
  const WorldDescription& world = course.world();
  const auto* gravity = std::get_if<UniformGravity>(&world.settings.gravity);
  double sum = 0;
  for (const BodyDescription& body : world.bodies) {
    const BodyProperties& properties = body.properties;
    if (properties.motion != Motion::kDynamic) continue;
    const Glance& glance = course.of(body.name)[sample];
    const Pose centre = centre_frame(properties);
    const Eigen::Vector3d spin = (glance.turn * centre.orientation).conjugate() * glance.spin;
    sum += properties.mass * glance.velocity.squaredNorm() / 2 +
           spin.cwiseAbs2().dot(Eigen::Vector3d(properties.inertia.data())) / 2;
    if (gravity != nullptr && properties.gravity)
      sum -= properties.mass * gravity->acceleration.dot(glance.place + glance.turn * centre.position);
  }
  return sum;
}

double energy_gain(const Course& course) {
  std::size_t samples = 0;
  for (const BodyDescription& body : course.world().bodies) {
    if (body.properties.motion == Motion::kDynamic) samples = course.of(body.name).size();
  }
  const double start = energy(course, 0);
  double largest = 0;
  for (std::size_t sample = 1; sample < samples; ++sample)
    largest = std::max(largest, energy(course, sample) / start - 1);
  return largest;
}

}  // namespace tessera::truth
