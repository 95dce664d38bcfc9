// The fields of what is packed (wire.h).
//
// Each struct is described once: describe() passes its fields to an archive, which measures, writes or reads
// them. Fields are packed without gaps, so padding is never sent and equal values have equal bytes.
#pragma once

#include <concepts>
#include <type_traits>

#include "lpss/base/since.h"
#include "lpss/partition/world_state.h"
#include "lpss/tick/messages.h"

namespace tessera {

template <typename T, typename U>
concept Is = std::same_as<std::remove_const_t<T>, U>;

template <typename Archive, Is<BodyId> T>
void describe(Archive& archive, T& x) {
  archive(x.value);
}
template <typename Archive, Is<JointId> T>
void describe(Archive& archive, T& x) {
  archive(x.value);
}
template <typename Archive, Is<SectorIndex> T>
void describe(Archive& archive, T& x) {
  archive(x.i, x.j, x.k, since(7, x.frame));
}
template <typename Archive, Is<Surface> T>
void describe(Archive& archive, T& x) {
  archive(x.direction, x.second_friction, x.torsional_friction, x.patch_radius, x.rolling_friction,
          x.velocity, x.running);
}
template <typename Archive, Is<Wrench> T>
void describe(Archive& archive, T& x) {
  archive(x.force, x.torque);
}
template <typename Archive, Is<LastingForce> T>
void describe(Archive& archive, T& x) {
  archive(x.wrench, x.turns_along);
}
template <typename Archive, Is<BodyProperties> T>
void describe(Archive& archive, T& x) {
  archive(x.motion, x.shape, x.mass, x.inertia, x.centre, x.principal_axes, x.friction, x.restitution,
          x.linear_damping, x.angular_damping, x.category, x.mask, x.gravity, x.assembly, x.surface,
          x.lasting, x.trigger);
}
template <typename Archive, Is<Velocities> T>
void describe(Archive& archive, T& x) {
  archive(x.linear, x.angular);
}
template <typename Archive, Is<BodyState> T>
void describe(Archive& archive, T& x) {
  archive(x.position, x.rotation, x.linear_velocity, x.angular_velocity, x.still_for, x.activity,
          x.velocities_before);
}
template <typename Archive, Is<ProgramRecord> T>
void describe(Archive& archive, T& x) {
  archive(x.kind, x.parameters, x.inputs, x.values, x.wake_at, x.start_sector, x.start, x.fault,
          since(6, x.name));
}
template <typename Archive, Is<BodyRecord> T>
void describe(Archive& archive, T& x) {
  archive(x.id, x.home, x.properties, x.state, since(5, x.programs));
}
template <typename Archive, Is<Pose> T>
void describe(Archive& archive, T& x) {
  archive(x.position.x(), x.position.y(), x.position.z(), x.orientation.x(), x.orientation.y(),
          x.orientation.z(), x.orientation.w());
}
template <typename Archive, Is<AxisMimic> T>
void describe(Archive& archive, T& x) {
  archive(x.leader, x.axis, x.multiplier, x.reference, x.offset);
}
template <typename Archive, Is<JointAxis> T>
void describe(Archive& archive, T& x) {
  archive(x.lower, x.upper, x.velocity_max, x.effort_max, x.damping, x.friction, x.spring_stiffness,
          x.spring_reference, x.mimic, since(7, x.armature));
}
template <typename Archive, Is<JointDrive> T>
void describe(Archive& archive, T& x) {
  archive(x.mode, x.target, x.stiffness, x.damping, x.velocity, x.effort);
}
template <typename Archive, Is<JointProperties> T>
void describe(Archive& archive, T& x) {
  archive(x.type, x.parent, x.child, x.anchor, x.in_parent, x.in_child, x.pitch, x.bodies_collide);
  for (std::size_t n = 0; n < axes_of(x).size(); ++n) archive(x.axes[n]);
}
template <typename Archive, Is<JointDrives> T>
void describe(Archive& archive, T& x) {
  archive(x[0], x[1]);
}
template <typename Archive, Is<JointLoads> T>
void describe(Archive& archive, T& x) {
  archive(x.effort, x.force, x.torque);
}
template <typename Archive, Is<JointRecord> T>
void describe(Archive& archive, T& x) {
  archive(x.id, x.properties, x.parent_motion, x.drives, x.loads);
}
template <typename Archive, Is<JointSide> T>
void describe(Archive& archive, T& x) {
  archive(x.pose, x.linear_velocity.x(), x.linear_velocity.y(), x.linear_velocity.z(), x.angular_velocity.x(),
          x.angular_velocity.y(), x.angular_velocity.z());
}
template <typename Archive, Is<JointTie> T>
void describe(Archive& archive, T& x) {
  archive(x.id, x.parent, x.child, x.parent_motion, x.bodies_collide);
}
template <typename Archive, Is<HeldJoint> T>
void describe(Archive& archive, T& x) {
  archive(x.record, x.coupled);
}
template <typename Archive, Is<SectorOffset> T>
void describe(Archive& archive, T& x) {
  archive(x.i, x.j, x.k);
}
template <typename Archive, Is<Overlap> T>
void describe(Archive& archive, T& x) {
  archive(x.trigger, x.visitor);
}
template <typename Archive, Is<ManifoldState> T>
void describe(Archive& archive, T& x) {
  archive(x.a, x.b, x.points);
}
template <typename Archive, Is<ReplicaIntroduction> T>
void describe(Archive& archive, T& x) {
  archive(x.id, x.properties);
}
template <typename Archive, Is<ReplicaUpdate> T>
void describe(Archive& archive, T& x) {
  archive(x.id, x.home, x.next_home, x.replicated_in, x.state, x.known_everywhere, x.jointed, x.surge);
}
template <typename Archive, Is<Handover> T>
void describe(Archive& archive, T& x) {
  archive(x.record, x.replicated_in, x.known_everywhere, x.wrench, x.jointed, x.surge, x.kinematic_target,
          x.joints);
}
template <typename Archive, Is<ManifoldTransfer> T>
void describe(Archive& archive, T& x) {
  archive(x.to, x.was_touching, x.manifold, x.is_overlap);
}
template <typename Archive, Is<Exchange> T>
void describe(Archive& archive, T& x) {
  archive(x.introductions, x.replicas, x.gone, x.handovers, x.manifolds, x.quiet, x.has_programs);
}
template <typename Archive, Is<Call> T>
void describe(Archive& archive, T& x) {
  archive(x.from, x.to);
}
template <typename Archive, Is<JointEnd> T>
void describe(Archive& archive, T& x) {
  archive(x.body, x.tied, x.host);
}
template <typename Archive, Is<JointHost> T>
void describe(Archive& archive, T& x) {
  archive(x.to, x.body, x.host);
}
template <typename Archive, Is<Agreement> T>
void describe(Archive& archive, T& x) {
  archive(x.quiet, x.goes_on, x.has_programs, x.calls, x.joint_ends, x.joint_hosts);
}
template <typename Archive, Is<MovedBody> T>
void describe(Archive& archive, T& x) {
  archive(x.record, x.replicated_in, x.known_everywhere, x.next_home, x.kinematic_target, x.dirty, x.joints);
}
template <typename Archive, Is<MovedClone> T>
void describe(Archive& archive, T& x) {
  archive(x.introduction, x.update, x.placed, x.fresh);
}
template <typename Archive, Is<IslandPart> T>
void describe(Archive& archive, T& x) {
  archive(x.shared, x.first, x.bodies, x.contacts, x.any_awake, x.all_want_sleep, x.substeps, x.bounces,
          x.is_indivisible);
}
template <typename Archive, Is<MovedSector> T>
void describe(Archive& archive, T& x) {
  archive(x.sector, x.bodies, x.clones, x.manifolds, x.touching, x.overlaps, x.static_region,
          x.parts_reported, x.parts, x.active);
}
template <typename Archive, Is<SectorSeams> T>
void describe(Archive& archive, T& x) {
  archive(x.sector, x.parts, x.is_news);
}
template <typename Archive, Is<KnownReplica> T>
void describe(Archive& archive, T& x) {
  archive(x.introduction, x.update);
}
template <typename Archive, Is<Eigen::Vector3d> T>
void describe(Archive& archive, T& x) {
  archive(x.x(), x.y(), x.z());
}
template <typename Archive, Is<FramePlace> T>
void describe(Archive& archive, T& x) {
  archive(x.origin.sector, x.origin.local, x.orientation.x(), x.orientation.y(), x.orientation.z(),
          x.orientation.w(), x.velocity, x.spin);
}
template <typename Archive, Is<CarriedFrame> T>
void describe(Archive& archive, T& x) {
  archive(x.frame, x.place, x.acceleration, x.angular_acceleration, x.felt, x.is_borne, x.ballast.mass,
          x.ballast.inertia, x.owed, x.owed_spin);
}
template <typename Archive, Is<ExactSum> T>
void describe(Archive& archive, T& x) {
  archive(x.high, x.low);
}
template <typename Archive, Is<BurdenSums> T>
void describe(Archive& archive, T& x) {
  archive(x.mass, x.first, x.second, x.inertia, x.momentum, x.spin, x.awake);
}
template <typename Archive, Is<FrameBurden> T>
void describe(Archive& archive, T& x) {
  archive(x.frame, x.before, x.after, x.centre);
}
template <typename Archive, Is<SharedState> T>
void describe(Archive& archive, T& x) {
  archive(x.radius_max, x.at_rest, x.statics, x.joints, x.known_replicas, since(5, x.acts),
          since(8, x.carried));
}
template <typename Archive, Is<Transfer> T>
void describe(Archive& archive, T& x) {
  archive(x.sectors, x.heard);
}
template <typename Archive, Is<Seams> T>
void describe(Archive& archive, T& x) {
  archive(x.sectors);
}
template <typename Archive, Is<ShippedBody> T>
void describe(Archive& archive, T& x) {
  archive(x.id, x.home, x.seam_stages, x.numbers_end);
}
template <typename Archive, Is<ShippedPair> T>
void describe(Archive& archive, T& x) {
  archive(x.a, x.b, x.numbers_end);
}
template <typename Archive, Is<ShippedIsland> T>
void describe(Archive& archive, T& x) {
  archive(x.island, x.bodies, x.pairs, x.body_numbers, x.pair_numbers, x.joints);
}
template <typename Archive, Is<Shipment> T>
void describe(Archive& archive, T& x) {
  archive(x.islands, x.staged);
}
template <typename Archive, Is<Motions> T>
void describe(Archive& archive, T& x) {
  archive(x.bytes);
}
template <typename Archive, Is<SolvedIsland> T>
void describe(Archive& archive, T& x) {
  archive(x.island, x.bodies, x.pairs);
}
template <typename Archive, Is<Solution> T>
void describe(Archive& archive, T& x) {
  archive(x.islands, x.blamed, x.joint_loads);
}
template <typename Archive, Is<ProgramAsk> T>
void describe(Archive& archive, T& x) {
  archive(x.kind, x.body, x.joint, x.sector, x.origin, x.direction, x.length, x.radius, x.mask);
}
template <typename Archive, Is<ProgramAsks> T>
void describe(Archive& archive, T& x) {
  archive(x.anybody_asks, x.has_strays, x.asks);
}
template <typename Archive, Is<ProgramFinding> T>
void describe(Archive& archive, T& x) {
  archive(x.ask, x.body, x.motion, x.distance, x.normal, x.point, x.velocity, x.impulse, x.position,
          x.rotation, x.mass, x.is_held);
}
template <typename Archive, Is<JointPart> T>
void describe(Archive& archive, T& x) {
  archive(x.ask, x.joint, x.record, x.parent, x.child);
}
template <typename Archive, Is<ProgramAnswers> T>
void describe(Archive& archive, T& x) {
  archive(x.findings, x.joints);
}
template <typename Archive, Is<ProgramAct> T>
void describe(Archive& archive, T& x) {
  archive(x.by, x.program, x.command);
}
template <typename Archive, Is<CrossingBody> T>
void describe(Archive& archive, T& x) {
  archive(x.id, x.home, x.state);
}
template <typename Archive, Is<Crossing> T>
void describe(Archive& archive, T& x) {
  archive(x.island, x.bodies, x.frame, x.comes_in, x.crossing);
}
template <typename Archive, Is<ProgramActs> T>
void describe(Archive& archive, T& x) {
  archive(x.acts, x.crossings, x.carried, x.burdens);
}

// Commands describe themselves.
template <typename Archive, typename T>
requires requires(Archive& archive, T& x) { std::remove_const_t<T>::describe(archive, x); }
void describe(Archive& archive, T& x) { std::remove_const_t<T>::describe(archive, x); }

}  // namespace tessera
