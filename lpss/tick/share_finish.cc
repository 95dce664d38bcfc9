// The end of a tick: velocities become motion, contacts become events, and what is at rest leaves the list.
#include <algorithm>
#include <cmath>

#include "lpss/base/invariant.h"
#include "lpss/model/limits.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

// `state` after `dt` seconds at its velocities.
BodyState coasted(BodyState state, double dt) {
  Eigen::Map<Eigen::Vector3d>(state.position.data()) += Eigen::Vector3d(state.linear_velocity.data()) * dt;
  const Eigen::Vector3d spin(state.angular_velocity.data());
  const double rate = spin.norm();
  if (rate > 0) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(rate * dt, spin / rate));
    state.rotation = rotation_of(turn * quaternion_of(state));
  }
  return state;
}

ContactEvent end_of(Tick tick, BodyId a, BodyId b) {
  ContactEvent event;
  event.tick = tick;
  event.phase = ContactPhase::kEnd;
  event.a = a;
  event.b = b;
  return event;
}

bool at_rest(const BodyState& state) {
  return state.linear_velocity == std::array<double, 3>{} &&
         state.angular_velocity == std::array<double, 3>{};
}

}  // namespace

void Share::finish(std::vector<Solution> inbox) {
  for (const Solution& solution : inbox) take_solution(solution);
  std::vector<std::uint32_t> stopped(stepped_.size(), 0);
  std::vector<std::vector<ContactEvent>> events(stepped_.size());
  run_parallel(stepped_.size(), [&](std::size_t i) {
    Sector& sector = *stepped_[i];
    if (report_contacts_) gather_events(sector, events[i]);
    for (const BodySlot slot : sector.lone) sector.world->coast(slot, dt());
    sector.lone.clear();
    sector.world->integrate(dt());
    move_kinematics(sector);
    stopped[i] = stop_runaways(sector);
  });
  events_.clear();
  for (std::size_t i = 0; i < stepped_.size(); ++i) {
    counts_.bodies_stopped += stopped[i];
    std::move(events[i].begin(), events[i].end(), std::back_inserter(events_));
  }
  if (report_contacts_) {
    for (const auto& [a, b] : ended_) events_.push_back(end_of(tick_, a, b));
  }
  ended_.clear();
  std::sort(events_.begin(), events_.end(), [](const ContactEvent& x, const ContactEvent& y) {
    return std::tie(x.a, x.b, x.phase) < std::tie(y.a, y.b, y.phase);
  });
  count();
  std::erase_if(active_, [&](Sector* sector) {
    const bool news = std::any_of(sector->homes.begin(), sector->homes.end(),
                                  [](const HomeBody* body) { return body->news || body->next_home; });
    sector->active = news || (sector->world && anything_awake(*sector));
    return !sector->active;
  });
}

// Velocities and impulses of islands that another server solved.
void Share::take_solution(const Solution& solution) {
  for (const SolvedBody& solved : solution.bodies) {
    const auto body = bodies_.find(solved.id);
    invariant(body != bodies_.end(), "a solution names bodies of the share that shipped them");
    body->second->sector->world->set_state(body->second->slot, solved.state);
  }
  for (const ShippedContact& contact : solution.contacts) {
    SectorWorld& world = *sectors_.at(contact.sector)->world;
    const std::span<const ContactPair> pairs = world.contacts();
    const auto pair = std::lower_bound(
        pairs.begin(), pairs.end(), contact.manifold,
        [](const ContactPair& p, const ManifoldState& m) { return std::tie(p.a, p.b) < std::tie(m.a, m.b); });
    invariant(pair != pairs.end() && pair->a == contact.manifold.a && pair->b == contact.manifold.b,
              "a solution names contacts of the share that shipped them");
    world.set_manifold(static_cast<std::size_t>(pair - pairs.begin()), contact.manifold);
  }
}

// Kinematic bodies go where they were told; one that stands still sleeps, so that it keeps nothing awake.
void Share::move_kinematics(Sector& sector) {
  for (HomeBody* body : sector.homes) {
    if (body->properties.motion != Motion::kKinematic) continue;
    SectorWorld& world = *sector.world;
    if (world.activity(body->slot) == Activity::kAsleep) continue;
    if (body->goal) {
      world.set_state(body->slot, *body->goal);
      body->goal.reset();
      continue;
    }
    const BodyState state = world.state(body->slot);
    if (at_rest(state)) {
      world.sleep(body->slot);
      body->news = true;
    } else {
      world.set_state(body->slot, coasted(state, dt()));
    }
  }
}

// A body that has left the range in which numbers mean something is stopped where it was last known to be.
std::uint32_t Share::stop_runaways(Sector& sector) {
  std::uint32_t stopped = 0;
  for (HomeBody* body : sector.homes) {
    SectorWorld& world = *sector.world;
    if (world.activity(body->slot) == Activity::kAsleep) continue;
    const Eigen::Vector3d velocity = world.linear_velocity(body->slot);
    const Eigen::Vector3d position = world.position(body->slot);
    if (velocity.squaredNorm() <= kSpeedMax * kSpeedMax && position.allFinite()) continue;
    BodyState state = world.state(body->slot);
    if (!position.allFinite()) {
      const Eigen::Vector3d last = body->swept.center();
      Eigen::Map<Eigen::Vector3d>(state.position.data()) = last.allFinite() ? last : Eigen::Vector3d::Zero();
      state.rotation = BodyState{}.rotation;
    }
    state.linear_velocity = {};
    state.angular_velocity = {};
    world.set_state(body->slot, state);
    ++stopped;
  }
  return stopped;
}

void Share::gather_events(Sector& sector, std::vector<ContactEvent>& events) {
  absl::flat_hash_set<std::pair<BodyId, BodyId>> now;
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ContactPair& pair = pairs[i];
    if (!reports(sector, pair)) continue;
    const ContactDetail detail = sector.world->contact_detail(i);
    if (detail.depth < 0 && detail.impulse <= 0) continue;
    now.insert({pair.a, pair.b});
    ContactEvent event;
    event.tick = tick_;
    event.phase = sector.touching.contains({pair.a, pair.b}) ? ContactPhase::kPersist : ContactPhase::kBegin;
    event.a = pair.a;
    event.b = pair.b;
    const absl::StatusOr<WorldPosition> position = canonical(sector.index, detail.position, size());
    if (position.ok()) event.position = *position;
    Eigen::Map<Eigen::Vector3d>(event.normal.data()) = detail.normal;
    event.impulse = detail.impulse;
    event.depth = detail.depth;
    events.push_back(event);
  }
  for (const auto& [a, b] : sector.touching) {
    if (!now.contains({a, b})) events.push_back(end_of(tick_, a, b));
  }
  sector.touching = std::move(now);
}

// Whether this sector speaks for the pair. Under the policy clone both sectors of a pair detect it; the one
// that would under the policy island reports it, and nobody reports what two clones do.
bool Share::reports(const Sector& sector, const ContactPair& pair) const {
  if (options_.settings.seams == SeamPolicy::kIsland) return true;
  const auto home_of = [&](BodyId id) -> const SectorIndex& {
    if (const auto body = bodies_.find(id); body != bodies_.end()) return body->second->sector->index;
    if (const auto ghost = ghosts_.find(id); ghost != ghosts_.end()) return ghost->second->home;
    return sector.index;
  };
  return detecting_sector(motion_of(pair.a), home_of(pair.a), motion_of(pair.b), home_of(pair.b)) ==
         sector.index;
}

void Share::count() {
  counts_.sectors = static_cast<std::uint32_t>(worlds_);
  counts_.sectors_awake = static_cast<std::uint32_t>(stepped_.size());
  counts_.clones = static_cast<std::uint32_t>(clones_);
  for (const Sector* sector : stepped_) {
    counts_.contacts += static_cast<std::uint32_t>(sector->world->contacts().size());
    for (const HomeBody* body : sector->homes) {
      counts_.bodies_awake += sector->world->activity(body->slot) != Activity::kAsleep ? 1 : 0;
    }
  }
}

}  // namespace tessera
