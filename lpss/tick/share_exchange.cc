// Round one: bodies change home, and sectors learn of the bodies near their borders.
#include <algorithm>
#include <bit>

#include "lpss/base/invariant.h"
#include "lpss/model/gravity.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

// A set of ranks; kServersMax is 64.
using Ranks = std::uint64_t;

Ranks owners(const SectorMap& map, const SectorIndex& home, const OffsetSet& targets) {
  Ranks ranks = 0;
  targets.for_each([&](const SectorOffset& offset) {
    const absl::StatusOr<SectorIndex> sector = translated(home, offset);
    if (sector.ok()) ranks |= Ranks{1} << map.owner(*sector);
  });
  return ranks;
}

template <typename Visit>
void for_each_rank(Ranks ranks, Visit&& visit) {
  for (; ranks != 0; ranks &= ranks - 1) visit(static_cast<Rank>(std::countr_zero(ranks)));
}

Ranks everyone(const SectorMap& map) { return ~Ranks{0} >> (64 - map.servers()); }

// Tells every share that has to know of a body, or had to until now.
struct Announcement {
  const SectorMap& map;
  std::vector<Exchange>& outbox;

  void send(const BodyProperties& properties, const GhostUpdate& update, Ranks before, Ranks now) const {
    for_each_rank(before & ~now, [&](Rank rank) { outbox[rank].gone.push_back(update.id); });
    for_each_rank(now & ~before, [&](Rank rank) {
      outbox[rank].introductions.push_back({update.id, properties});
    });
    for_each_rank(now, [&](Rank rank) { outbox[rank].ghosts.push_back(update); });
  }
};

bool by_index(const Sector* a, const Sector* b) { return a->index < b->index; }

// All items of one kind in an inbox, in ascending order of ids, whoever sent them.
template <typename T, typename Id>
std::vector<T> collected(std::vector<Exchange>& inbox, std::vector<T> Exchange::*items, Id&& id) {
  std::vector<T> all;
  for (Exchange& message : inbox) {
    std::move((message.*items).begin(), (message.*items).end(), std::back_inserter(all));
  }
  std::sort(all.begin(), all.end(), [&](const T& a, const T& b) { return id(a) < id(b); });
  return all;
}

}  // namespace

// Applies the commands, moves bodies to their new homes, and says what others must know of bodies near seams.
std::vector<Exchange> Share::tell_of_seams() {
  phase_clock_.enter(TickPhase::kSectorization);
  margins_changed_ = false;
  std::vector<Exchange> outbox(options_.map.servers());
  for (const Command& command : commands_) apply(command);
  export_manifolds(outbox);
  move_homes(outbox);

  if (margins_changed_) {
    for (auto& [id, body] : bodies_) {
      body->news = true;
      activate(*body->sector);
    }
  }
  leaving_.clear();
  const auto may_have_moved = [](const HomeBody& body) {
    return body.news || body.sector->world->activity(body.slot) != Activity::kAsleep;
  };
  for (Sector* sector : active_) {
    for (HomeBody* body : sector->homes) {
      if (may_have_moved(*body)) announce(*body);
    }
  }

  phase_clock_.enter(TickPhase::kSeamSearch);
  for (Sector* sector : active_) {
    for (HomeBody* body : sector->homes) {
      if (!may_have_moved(*body)) continue;
      body->swept = sector->world->swept_box(body->slot, dt());
      body->near = sectors_to_tell(body->swept, body->properties.motion);
    }
  }
  if (options_.settings.seams == SeamPolicy::kClone && options_.settings.clone_depth > 1) {
    for (Sector* sector : active_) deepen_clones(*sector);
  }

  phase_clock_.enter(TickPhase::kExchange);
  for (Sector* sector : active_) {
    for (HomeBody* body : sector->homes) {
      if (may_have_moved(*body) || !(body->near == body->targets)) update_ghosts(*body, outbox);
    }
  }
  const bool quiet = active_.empty() && vacated_.empty() && commands_.empty();
  for (Exchange& message : outbox) message.quiet = quiet;
  return outbox;
}

// The sectors that need a clone of a body whose box sweeps `swept`.
OffsetSet Share::sectors_to_tell(const Eigen::AlignedBox3d& swept, Motion motion) const {
  const WorldSettings& settings = options_.settings;
  if (settings.seams == SeamPolicy::kClone && settings.clone_depth == 0) return {};
  return clone_targets(sectors_within_reach(swept, margins_), settings.seams, motion);
}

// Contact points follow their pair to the sector that detects it from this tick on. Every share that detected
// a pair with a moving body knows the homes of both: of its own bodies, and of ghosts by the last exchange.
void Share::export_manifolds(std::vector<Exchange>& outbox) {
  if (leaving_.empty() && moving_ghosts_.empty()) return;
  absl::flat_hash_set<BodyId> moving(leaving_.begin(), leaving_.end());
  moving.insert(moving_ghosts_.begin(), moving_ghosts_.end());
  std::vector<Sector*> concerned;
  for (const BodyId id : moving) {
    if (const auto body = bodies_.find(id); body != bodies_.end()) concerned.push_back(body->second->sector);
    if (const auto ghost = ghosts_.find(id); ghost != ghosts_.end()) {
      for (const SectorIndex& place : ghost->second->places) concerned.push_back(sectors_.at(place).get());
    }
  }
  std::sort(concerned.begin(), concerned.end(), by_index);
  concerned.erase(std::unique(concerned.begin(), concerned.end()), concerned.end());

  for (Sector* sector : concerned) {
    if (!sector->world) continue;
    const std::span<const ContactPair> pairs = sector->world->contacts();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const ContactPair& pair = pairs[i];
      if (!moving.contains(pair.a) && !moving.contains(pair.b)) continue;
      const SectorIndex& to =
          detecting_sector(motion_of(pair.a), next_home(pair.a), motion_of(pair.b), next_home(pair.b));
      const auto keeps_role = [&](BodyId id) {
        return motion_of(id) == Motion::kStatic || lives_in(id, *sector) == (next_home(id) == to);
      };
      const bool same_roles = to == sector->index && keeps_role(pair.a) && keeps_role(pair.b);
      if (same_roles) continue;
      const bool was_touching = sector->touching.erase({pair.a, pair.b}) > 0;
      ManifoldTransfer transfer{to, was_touching, {pair.a, pair.b, {}}};
      if (options_.settings.seams == SeamPolicy::kIsland) {
        transfer.manifold = sector->world->export_manifold(i);
      } else if (!was_touching) {
        continue;  // both sectors have points of their own; only the event is handed over
      }
      outbox[options_.map.owner(to)].manifolds.push_back(std::move(transfer));
    }
  }
}

Motion Share::motion_of(BodyId id) const {
  if (const auto body = bodies_.find(id); body != bodies_.end()) return body->second->properties.motion;
  if (const auto ghost = ghosts_.find(id); ghost != ghosts_.end()) return ghost->second->properties.motion;
  return Motion::kStatic;
}

// The home of a body from this tick on. A static body's is not looked at by anyone.
const SectorIndex& Share::next_home(BodyId id) const {
  static const SectorIndex kNowhere;
  if (const auto body = bodies_.find(id); body != bodies_.end()) {
    return body->second->next_home ? *body->second->next_home : body->second->sector->index;
  }
  if (const auto ghost = ghosts_.find(id); ghost != ghosts_.end()) return ghost->second->next_home;
  return kNowhere;
}

bool Share::lives_in(BodyId id, const Sector& sector) const {
  const auto body = bodies_.find(id);
  return body != bodies_.end() && body->second->sector == &sector;
}

// Carries out the moves that were announced in the last tick, and the jumps that commands asked for. The old
// home speaks for the body once more, as nobody else knows who has clones of it.
void Share::move_homes(std::vector<Exchange>& outbox) {
  std::sort(leaving_.begin(), leaving_.end());
  for (const BodyId id : leaving_) {
    HomeBody& body = *bodies_.at(id);
    const SectorIndex old_home = body.sector->index;
    const SectorIndex new_home = *body.next_home;
    Handover handover;
    handover.targets = body.targets;
    handover.everywhere = body.everywhere;
    handover.record = remove_home(body);
    handover.record.home = new_home;
    const Eigen::Vector3d position =
        metres_between(new_home, old_home, size()) + Eigen::Vector3d(handover.record.state.position.data());
    Eigen::Map<Eigen::Vector3d>(handover.record.state.position.data()) = position;
    jumps_.push_back({std::move(handover), old_home});
  }
  for (auto& [handover, old_home] : jumps_) {
    BodyRecord& record = handover.record;
    const Ranks all = handover.everywhere ? everyone(options_.map) : 0;
    const Ranks before = all | owners(options_.map, old_home, handover.targets);
    const Eigen::AlignedBox3d swept = swept_ball(record.state, radius_of(record.properties), dt());
    handover.targets = sectors_to_tell(swept, record.properties.motion);
    Announcement{options_.map, outbox}.send(
        record.properties, {record.id, record.home, record.home, handover.targets, record.state}, before,
        all | owners(options_.map, record.home, handover.targets));
    outbox[options_.map.owner(record.home)].handovers.push_back(std::move(handover));
  }
  jumps_.clear();
}

// Decides whether the body changes home; everyone hears of it one tick before it happens.
void Share::announce(HomeBody& body) {
  body.next_home.reset();
  SectorWorld& world = *body.sector->world;
  const std::optional<SectorOffset> offset = leaves_home(world.position(body.slot), margins_);
  if (!offset) return;
  const absl::StatusOr<SectorIndex> next = translated(body.sector->index, *offset);
  if (!next.ok()) {
    // The edge of the representable world: the body stops here.
    world.set_velocity(body.slot, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    ++counts_.bodies_stopped;
    return;
  }
  body.next_home = *next;
  leaving_.push_back(body.id);
}

// Policy clone, depth k > 1: what touches a body that is cloned is cloned with it, k - 1 contacts deep.
void Share::deepen_clones(Sector& sector) {
  if (!sector.world) return;
  const auto place_of = [&](BodyId id) -> std::optional<std::size_t> {
    const auto place =
        std::lower_bound(sector.homes.begin(), sector.homes.end(), id,
                         [](const HomeBody* body, BodyId wanted) { return body->id < wanted; });
    if (place == sector.homes.end() || (*place)->id != id) return std::nullopt;
    return static_cast<std::size_t>(place - sector.homes.begin());
  };
  std::vector<OffsetSet> reached(sector.homes.size());
  for (int depth = 1; depth < options_.settings.clone_depth; ++depth) {
    for (std::size_t n = 0; n < sector.homes.size(); ++n) reached[n] = sector.homes[n]->near;
    for (const ContactPair& pair : sector.world->contacts()) {
      const auto a = place_of(pair.a);
      const auto b = place_of(pair.b);
      if (!a || !b) continue;
      sector.homes[*a]->near.merge(reached[*b]);
      sector.homes[*b]->near.merge(reached[*a]);
    }
  }
}

void Share::update_ghosts(HomeBody& body, std::vector<Exchange>& outbox) {
  const SectorIndex& home = body.sector->index;
  const auto informed = [&] {
    return (body.everywhere ? everyone(options_.map) : 0) | owners(options_.map, home, body.targets);
  };
  const Ranks before = informed();
  body.targets = body.near;
  body.everywhere = is_everywhere(body);
  body.news = false;
  const Ranks now = informed();
  if (before == 0 && now == 0) return;
  Announcement{options_.map, outbox}.send(
      body.properties,
      {body.id, home, body.next_home.value_or(home), body.targets, body.sector->world->state(body.slot)},
      before, now);
}

void Share::take_ghosts(std::vector<Exchange>& inbox) {
  moving_ghosts_.clear();
  for (const BodyId id : collected(inbox, &Exchange::gone, [](BodyId id) { return id; })) forget_ghost(id);
  for (const BodyIntroduction& news :
       collected(inbox, &Exchange::introductions, [](const BodyIntroduction& i) { return i.id; })) {
    introduce(news);
  }
  for (GhostUpdate& update : collected(inbox, &Exchange::ghosts, [](const GhostUpdate& u) { return u.id; })) {
    const auto found = ghosts_.find(update.id);
    invariant(found != ghosts_.end(), "a ghost is introduced before it is updated");
    Ghost& ghost = *found->second;
    revise(ghost, update);
    if (ghost.next_home != ghost.home) moving_ghosts_.push_back(ghost.id);
    place_ghost(ghost);
  }
}

Ghost& Share::introduce(const BodyIntroduction& news) {
  std::unique_ptr<Ghost>& ghost = ghosts_[news.id];
  if (!ghost) ghost = std::make_unique<Ghost>();
  ghost->id = news.id;
  ghost->properties = news.properties;
  ghost->radius = radius_of(news.properties);
  return *ghost;
}

void Share::revise(Ghost& ghost, const GhostUpdate& update) {
  ghost.home = update.home;
  ghost.next_home = update.next_home;
  ghost.targets = update.targets;
  ghost.state = update.state;
}

// Puts the ghost on the lists of the sectors that need it, and off those that no longer do.
void Share::place_ghost(Ghost& ghost) {
  std::vector<SectorIndex> places;
  ghost.targets.for_each([&](const SectorOffset& offset) {
    const absl::StatusOr<SectorIndex> sector = translated(ghost.home, offset);
    if (sector.ok() && mine(*sector)) places.push_back(*sector);
  });
  for (const SectorIndex& old : ghost.places) {
    if (std::binary_search(places.begin(), places.end(), old)) continue;
    displace(ghost.id, old);
  }
  for (const SectorIndex& place : places) {
    Sector& sector = sector_at(place);
    Clone& clone = sector.clones[ghost.id];
    clone.ghost = &ghost;
    clone.fresh = true;
    if (sector.world && (ghost.state.activity != Activity::kAsleep || clone.slot != Clone::kNotPlaced)) {
      activate(sector);
    }
  }
  ghost.places = std::move(places);
}

// Takes the ghost off the list of one sector.
void Share::displace(BodyId id, const SectorIndex& place) {
  Sector& sector = *sectors_.at(place);
  const auto clone = sector.clones.find(id);
  invariant(clone != sector.clones.end(), "a ghost knows the sectors that list it");
  unplace_clone(sector, clone->second);
  sector.clones.erase(clone);
  if (!sector.world && sector.clones.empty()) activate(sector);  // to be dropped
}

void Share::forget_ghost(BodyId id) {
  const auto found = ghosts_.find(id);
  if (found == ghosts_.end()) return;
  for (const SectorIndex& place : found->second->places) displace(id, place);
  ghosts_.erase(found);
}

void Share::unplace_clone(Sector& sector, Clone& clone) {
  if (clone.slot == Clone::kNotPlaced) return;
  take_out(sector, clone);
  activate(sector);
}

void Share::take_out(Sector& sector, Clone& clone) {
  sector.world->remove(clone.slot);
  clone.slot = Clone::kNotPlaced;
  --sector.placed;
  sector.regroup = true;
}

void Share::take_handovers(std::vector<Exchange>& inbox) {
  for (Handover& handover :
       collected(inbox, &Exchange::handovers, [](const Handover& h) { return h.record.id; })) {
    invariant(mine(handover.record.home), "a body is handed to the share that hosts its new home");
    // Awake, so that the new home finds its contacts at once.
    if (handover.record.state.activity == Activity::kAsleep) {
      handover.record.state.activity = Activity::kAwake;
      handover.record.state.still_for = 0;
    }
    HomeBody& body = add_home(handover.record);
    body.targets = handover.targets;
    body.everywhere = handover.everywhere;
    body.news = true;
    body.swept = body.sector->world->swept_box(body.slot, dt());
  }
}

void Share::take_manifolds(std::vector<Exchange>& inbox) {
  const auto order = [](const ManifoldTransfer& m) { return std::tuple(m.to, m.manifold.a, m.manifold.b); };
  for (ManifoldTransfer& transfer : collected(inbox, &Exchange::manifolds, order)) {
    const auto sector = sectors_.find(transfer.to);
    if (sector == sectors_.end() || !sector->second->world) continue;
    if (!transfer.manifold.points.empty()) sector->second->world->import_manifold(transfer.manifold);
    if (transfer.was_touching) sector->second->touching.insert({transfer.manifold.a, transfer.manifold.b});
  }
}

// Policy clone, depth k > 1: the clones that a sector was told of are there for other clones, too.
bool Share::supports_clones(const Sector& sector) const {
  return options_.settings.seams == SeamPolicy::kClone && options_.settings.clone_depth > 1 &&
         !sector.homes.empty();
}

// Policy clone: whether a joint ties a body to one that lives in the sector, so that the sector needs its
// clone.
bool Share::is_jointed_here(BodyId id, const Sector& sector) const {
  if (options_.settings.seams != SeamPolicy::kClone) return false;
  const std::span<const JointId> joints = joints_.of(id);
  return std::any_of(joints.begin(), joints.end(), [&](JointId joint) {
    return lives_in(partner_of(joints_.find(joint)->properties, id), sector);
  });
}

// Brings the clones of one sector up to date: in the engine world are those that something living here may
// touch in this tick (the paper's "imminent contact").
void Share::refresh_clones(Sector& sector) {
  if (sector.homes.empty()) return;
  constexpr double kContactMargin = 0.05;  // m, beyond the distance at which engines keep contact points
  SectorWorld& world = *sector.world;
  for (auto& [id, clone] : sector.clones) {
    if (clone.slot != Clone::kNotPlaced && !clone.fresh) continue;
    const Ghost& ghost = *clone.ghost;
    const BodyRecord record = seen_in(sector, ghost);
    const bool imminent =
        supports_clones(sector) || is_jointed_here(id, sector) ||
        world.reaches_home_body(swept_ball(record.state, ghost.radius + kContactMargin, dt()));
    if (!imminent) {
      if (clone.slot != Clone::kNotPlaced) take_out(sector, clone);
      continue;
    }
    if (clone.slot == Clone::kNotPlaced) {
      place_clone(sector, clone);
    } else {
      world.set_state(clone.slot, record.state);
      pull_clone(sector, clone);
    }
    clone.fresh = false;
  }
}

BodyRecord Share::seen_in(const Sector& sector, const Ghost& ghost) const {
  BodyRecord record{ghost.id, ghost.home, ghost.properties, ghost.state};
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) +=
      metres_between(sector.index, ghost.home, size());
  return record;
}

void Share::place_clone(Sector& sector, Clone& clone) {
  clone.slot = sector.world->add(seen_in(sector, *clone.ghost), Role::kClone);
  ++sector.placed;
  sector.regroup = true;
  pull_clone(sector, clone);
}

// Policy clone: clones are solved where they are, and fall as their originals do.
void Share::pull_clone(Sector& sector, const Clone& clone) {
  if (!clone.ghost->properties.gravity || options_.settings.seams != SeamPolicy::kClone) return;
  sector.world->set_gravity(clone.slot, acceleration_at(options_.settings.gravity, sector.index,
                                                        sector.world->position(clone.slot), size()));
}

}  // namespace tessera
