#include "lpss/tick/landings.h"

#include <absl/container/flat_hash_map.h>

#include <utility>

#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/sectors.h"
#include "lpss/partition/statics.h"
#include "lpss/tick/contact_points.h"

namespace tessera {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Where the programs of a body began is a place in its frame. Of one that has come from another frame, where
// it was at `before`, that place comes along as it lies from the body.
void take_starts_along(const WorldPosition& before, const Quaterniond& turn, double sector_size,
                       BodyRecord& record) {
  const Vector3d after(record.state.position.data());
  for (ProgramRecord& program : record.programs) {
    const Vector3d way = metres_between(before.sector, program.start_sector, sector_size) +
                         Vector3d(program.start.data()) - before.local;
    const auto place = canonical(record.home, after + turn * way, sector_size);
    program.start_sector =
        place.ok() ? place->sector : record.home;  // there is nothing beyond the last sector
    Eigen::Map<Vector3d>(program.start.data()) = place.ok() ? place->local : after;
  }
}

// Puts a body where a teleport says, which turns it by `turn`, and leaves the rest of it as it is.
void carry_out(const Teleport& jump, const Quaterniond& turn, double sector_size, BodyRecord& record) {
  const WorldPosition before{record.home, Vector3d(record.state.position.data())};
  const BodyState now = record.state;
  record.home = jump.home;
  record.state = jump.state;
  if (jump.keeps_linear_velocity) record.state.linear_velocity = now.linear_velocity;
  if (jump.keeps_angular_velocity) record.state.angular_velocity = now.angular_velocity;
  if (jump.keeps_rotation) {
    keep_rotation(record.properties, now, record.state);
    const auto place = canonical(jump.home, Vector3d(record.state.position.data()), sector_size);
    if (place.ok()) {  // otherwise beyond the last sector: its centre stays outside of that one
      record.home = place->sector;
      Eigen::Map<Vector3d>(record.state.position.data()) = place->local;
    }
  }
  if (record.home.frame != before.sector.frame) take_starts_along(before, turn, sector_size, record);
}

// Whether a body that jumps lands in its sector, and would have stayed there; the same at all who know it.
bool stays_home(const Partition& partition, const Teleport& jump) {
  if (const auto body = partition.bodies.find(jump.id); body != partition.bodies.end())
    return body->second->sector->index == jump.home && !body->second->next_home;
  const auto replica = partition.replicas.find(jump.id);
  return replica != partition.replicas.end() && replica->second->home == jump.home &&
         replica->second->next_home == jump.home;
}

void move_static(Partition& partition, const Teleport& jump) {
  BodyRecord moved = *partition.statics.find(jump.id);
  carry_out(jump, Quaterniond::Identity(), partition.sector_size(), moved);
  remove_static_body(partition, jump.id);
  add_static_body(partition, moved);
  for (const JointId joint : partition.joints.of(jump.id))
    wake_jointed(partition, *partition.joints.find(joint));
}

}  // namespace

void keep_rotation(const BodyProperties& properties, const BodyState& now, BodyState& next) {
  next.rotation = now.rotation;
  const Pose centre = centre_frame(properties);
  const Eigen::Quaterniond body_frame = quaternion_of(now) * centre.orientation.conjugate();
  Eigen::Map<Vector3d>(next.position.data()) += body_frame * centre.position;
}

void Landings::add(Partition& partition, const Teleport& jump) {
  if (partition.statics.find(jump.id)) return move_static(partition, jump);
  Landing& landing = jumps_[jump.id];
  landing.jump = jump;
  const auto found = partition.bodies.find(jump.id);
  if (found == partition.bodies.end()) return;
  HomeBody& body = *found->second;
  body.kinematic_target.reset();
  BodyState state = body.sector->world->state(body.slot);
  if (!jump.keeps_rotation) {
    landing.turn = quaternion_of(jump.state) * quaternion_of(state).conjugate() * landing.turn;
    state.rotation = jump.state.rotation;
  }
  if (!jump.keeps_linear_velocity) state.linear_velocity = jump.state.linear_velocity;
  if (!jump.keeps_angular_velocity) state.angular_velocity = jump.state.angular_velocity;
  body.sector->world->set_state(body.slot, state);
}

BodyRecord Landings::record(const Partition& partition, const HomeBody& body) const {
  BodyRecord record = record_of(body);
  const auto found = jumps_.find(body.id);
  if (found == jumps_.end()) return record;
  Teleport jump = found->second.jump;
  jump.keeps_linear_velocity = jump.keeps_angular_velocity = true;
  carry_out(jump, found->second.turn, partition.sector_size(), record);
  return record;
}

void Landings::keep_contacts(Partition& partition, std::vector<Exchange>& outbox) const {
  absl::flat_hash_map<BodyId, SectorIndex> homes;
  for (const auto& [id, landing] : jumps_) {
    if (landing.jump.keeps_contacts) homes.emplace(id, landing.jump.home);
  }
  if (!homes.empty()) send_contacts_along(partition, homes, outbox);
}

std::vector<HomeChange> Landings::carry_out_all(Partition& partition, std::vector<Exchange>& outbox) const {
  keep_contacts(partition, outbox);
  std::vector<HomeChange> changes;
  for (const auto& [id, landing] : jumps_) {
    const Teleport& jump = landing.jump;
    const bool stays = jump.keeps_contacts && stays_home(partition, jump);
    if (!stays) {
      lift_clones(partition, id);
      forget_moves(partition, id);
    }
    const auto found = partition.bodies.find(id);
    if (found == partition.bodies.end()) continue;
    HomeBody& body = *found->second;
    wake_touching(partition, *body.sector, body.slot);
    const BodyRecord landed = record(partition, body);
    if (stays) {
      body.sector->world->set_state(body.slot, landed.state);
      mark_dirty(body);
      activate(partition, *body.sector);
      continue;
    }
    changes.push_back(taken_to(partition, body, landed.home, landed.state));
    changes.back().handover.record.programs = landed.programs;
  }
  return changes;
}

}  // namespace tessera
