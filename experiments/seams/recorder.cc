#include "experiments/seams/recorder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace tessera::seams {
namespace {

double kinetic(const Sample& sample, double mass, const Eigen::Vector3d& inertia) {
  const Eigen::Vector3d spin = sample.orientation.conjugate() * sample.angular_velocity;
  return 0.5 * mass * sample.linear_velocity.squaredNorm() + 0.5 * spin.cwiseAbs2().dot(inertia);
}

void keep_largest(double& largest, double value) {
  if (!(largest >= value)) largest = value;
}

}  // namespace

Recorder::Recorder(const Scene& scene, const Stage& stage, std::span<const JointRecord> joints)
    : scene_(scene), stage_(stage), joints_(joints) {
  const WorldDescription& world = stage.world;
  const auto* gravity = std::get_if<UniformGravity>(&world.settings.gravity);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    const BodyProperties& body = world.bodies[i].properties;
    const WorldPose& pose = world.bodies[i].pose;
    const BodyId id{i + 1};
    if (body.motion != Motion::kDynamic) {
      const Pose frame{relative_to(pose.position, world.anchor, world.settings.sector_size) - stage.origin,
                       pose.orientation};
      fixed_sides_[id].pose = frame * centre_frame(body);
      continue;
    }
    const double pull = gravity != nullptr && body.gravity ? -gravity->acceleration.z() : 0;
    masses_.push_back({body.mass, Eigen::Vector3d(body.inertia.data()), body.mass * pull});
  }
}

Samples Recorder::samples_of(const Simulation& simulation) {
  Samples samples;
  samples.reserve(masses_.size());
  const WorldDescription& world = stage_.world;
  simulation.for_each_body([&](const BodyRecord& record) {
    if (record.properties.motion != Motion::kDynamic) return;
    Sample sample;
    sample.id = record.id;
    sample.position = metres_between(world.anchor, record.home, world.settings.sector_size) +
                      Eigen::Vector3d(record.state.position.data()) - stage_.origin;
    sample.orientation = quaternion_of(record.state);
    sample.linear_velocity = Eigen::Vector3d(record.state.linear_velocity.data());
    sample.angular_velocity = Eigen::Vector3d(record.state.angular_velocity.data());
    sample.asleep = record.state.activity == Activity::kAsleep;
    samples.push_back(sample);
  });
  return samples;
}

void Recorder::observe(Tick tick, const Simulation& simulation) {
  Samples samples = samples_of(simulation);
  if (tick == 0) {
    course_.start = samples;
    for (const Sample& sample : samples) {
      places_[sample.id] = course_.highest.size();
      course_.highest.push_back(sample.position);
    }
    last_ = samples;
  }
  const Tick second = static_cast<Tick>(std::lround(1 / stage_.world.settings.time_step));
  if (tick == second) course_.at_second = samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    course_.highest[i] = course_.highest[i].cwiseMax(samples[i].position);
  }
  if (scene_.free) measure_momentum(samples);
  if (scene_.energy != EnergyRule::kOpen) measure_energy(samples);
  if (2 * tick > second) measure_jolt(samples, tick);
  if (!joints_.empty()) measure_joints(samples);
  if (tick > 0) count_events(simulation.contact_events());
  course_.ticks = tick;
  course_.islands_across_seams =
      std::max(course_.islands_across_seams, simulation.counts().islands_across_seams);
  last_ = std::move(samples);
}

void Recorder::measure_momentum(const Samples& samples) {
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < samples.size(); ++i) momentum += masses_[i].mass * samples[i].linear_velocity;
  if (momentum_scale_ == 0) {
    momentum_start_ = momentum;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      momentum_scale_ += masses_[i].mass * samples[i].linear_velocity.norm();
    }
  }
  keep_largest(course_.momentum_drift, (momentum - momentum_start_).norm() / momentum_scale_);
}

void Recorder::measure_energy(const Samples& samples) {
  double energy = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    energy += kinetic(samples[i], masses_[i].mass, masses_[i].inertia) +
              masses_[i].weight * (samples[i].position.z() - scene_.lowest);
  }
  if (energy_start_ == 0) energy_start_ = energy_lowest_ = energy;
  const double drift =
      scene_.energy == EnergyRule::kKept ? std::abs(energy - energy_start_) : energy - energy_lowest_;
  energy_lowest_ = std::min(energy_lowest_, energy);
  keep_largest(course_.energy_drift, drift / energy_start_);
}

void Recorder::measure_jolt(const Samples& samples, Tick tick) {
  if (tick == 0) return;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    keep_largest(course_.jolt_max, std::abs((samples[i].linear_velocity - last_[i].linear_velocity).z()));
  }
}

JointSide Recorder::side_of(const JointProperties& joint, BodyId body, const Samples& samples) const {
  const WorldDescription& world = stage_.world;
  if (body == BodyId{}) {
    JointSide side;
    side.pose.position =
        metres_between(world.anchor, joint.anchor, world.settings.sector_size) - stage_.origin;
    return side;
  }
  const auto place = places_.find(body);
  if (place == places_.end()) return fixed_sides_.at(body);
  const Sample& sample = samples[place->second];
  return {{sample.position, sample.orientation}, sample.linear_velocity, sample.angular_velocity};
}

void Recorder::measure_joints(const Samples& samples) {
  for (const JointRecord& joint : joints_) {
    const JointState state =
        joint_state(joint.properties, side_of(joint.properties, joint.properties.parent, samples),
                    side_of(joint.properties, joint.properties.child, samples));
    keep_largest(course_.joint_gap_max, state.gap);
  }
}

void Recorder::count_events(std::span<const ContactEvent> events) {
  absl::flat_hash_set<std::tuple<BodyId, BodyId, std::array<double, 3>, std::array<double, 3>>> patches;
  absl::flat_hash_set<std::pair<BodyId, BodyId>> seen;
  double deepest = 0;
  for (const ContactEvent& event : events) {
    const std::pair pair(event.a, event.b);
    deepest = std::max(deepest, event.depth);
    const Eigen::Vector3d& place = event.position.local;
    if (!patches.insert({event.a, event.b, {place.x(), place.y(), place.z()}, event.normal}).second)
      ++course_.duplicate_events;
    if (!seen.insert(pair).second) continue;  // another patch
    const bool begins = event.phase == ContactPhase::kBegin;
    if (begins == touching_.contains(pair)) ++course_.broken_events;
    if (begins) {
      touching_.insert(pair);
      ++course_.contact_begins;
    }
    if (event.phase == ContactPhase::kEnd) touching_.erase(pair);
  }
  course_.penetration_max = std::max(course_.penetration_max, deepest);
  if (!events.empty()) course_.penetration_end = deepest;
}

Course Recorder::finish(const Simulation& simulation) {
  course_.end = last_;
  course_.world_hash = simulation.hash().to_string();
  return std::move(course_);
}

}  // namespace tessera::seams
