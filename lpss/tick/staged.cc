#include "lpss/tick/staged.h"

#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <bit>
#include <map>
#include <string_view>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"

namespace tessera {
namespace {

bool is_seam_stage(ContactStage stage) { return stage >= kSeamStage && stage < kSeamStage + kSeamStages; }

template <typename Visit>
void for_each_around(const SectorIndex& sector, const Visit& visit) {
  for (std::int64_t i = -1; i <= 1; ++i) {
    for (std::int64_t j = -1; j <= 1; ++j) {
      for (std::int64_t k = -1; k <= 1; ++k) {
        if (const auto other = translated(sector, {i, j, k}); other.ok()) visit(*other);
      }
    }
  }
}

SeamStages stage_bit(ContactStage stage) { return static_cast<SeamStages>(1 << (stage - kSeamStage)); }
bool has_stage(SeamStages stages, ContactStage stage) { return ((stages >> (stage - kSeamStage)) & 1) != 0; }

// Whether a server may solve a block of another, which tells it all that it needs for that.
bool may_follow(Rank follower, Rank host, const Ranks& hosts_of_block) {
  return (hosts_of_block - Ranks{follower, host}).empty();
}

const HomeBody* home_in_slot(const Sector& sector, BodySlot slot) {
  const auto place = static_cast<std::size_t>(slot);
  return place < sector.by_slot.size() ? sector.by_slot[place] : nullptr;
}

// The servers that host parts of an island around a sector, as far as `is_wanted` says of each sector there.
template <typename IsWanted>
Ranks hosts_around(const SectorIndex& sector, const IslandSectors& sectors, const IsWanted& is_wanted) {
  Ranks hosts;
  for_each_around(sector, [&](const SectorIndex& near) {
    const auto host = sectors.find(near);
    if (host != sectors.end() && is_wanted(near)) hosts.insert(host->second);
  });
  return hosts;
}

// Those that host parts in the block of a stage that a sector belongs to.
Ranks hosts_of_block(const SectorIndex& sector, ContactStage stage, const IslandSectors& sectors,
                     const SectorIndex& anchor) {
  const SectorIndex block = block_of(sector, stage, anchor);
  return hosts_around(sector, sectors,
                      [&](const SectorIndex& near) { return block_of(near, stage, anchor) == block; });
}

// What others must know of an island's bodies and contacts that are hosted here.
class IslandAtSeams {
 public:
  IslandAtSeams(const Partition& partition, const SeamIsland& island, const IslandSectors& sectors)
      : partition_(partition), island_(island), sectors_(sectors) {}

  void add_part(Sector& sector, const Component& component) {
    for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
      const HomeBody& body = *sector.component_bodies[i];
      if (!body.replicated_in.empty()) bodies_.emplace(body.id, Known{&body});
    }
    const std::span<const ContactPair> pairs = sector.world->contacts();
    for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
      const std::uint32_t n = sector.component_pairs[i];
      const ContactPair& pair = pairs[n];
      const HomeBody* const home_a = home_in_slot(sector, pair.slot_a);
      const HomeBody* const home_b = home_in_slot(sector, pair.slot_b);
      if ((home_a == nullptr) == (home_b == nullptr)) continue;
      const HomeBody& body = home_a != nullptr ? *home_a : *home_b;
      const auto clone = sector.clones.find(home_a != nullptr ? pair.b : pair.a);
      if (clone == sector.clones.end()) continue;  // a static body
      const Replica& other = *clone->second->replica;
      if (body.properties.motion != Motion::kDynamic || other.properties.motion != Motion::kDynamic) continue;
      bodies_.try_emplace(body.id, Known{&body});
      contacts_.push_back({&sector, n, {island_.id, body.id, other.id, sector.index, other.home}});
    }
  }

  // Once all parts have been added. Returns the servers that were told something, if only that there is
  // nothing.
  Ranks tell(StagedIslands& staged, std::vector<Shipment>& outbox) {
    find_stages();
    for (const auto& [id, known] : bodies_) {
      staged.own.emplace(id, known.body->sector->index);
      staged.seam_stages.emplace(id, known.stages);
    }
    for (const Found& found : contacts_) staged.contacts.push_back(found.contact);
    Ranks around;
    for (const auto& [sector, host] : sectors_) {
      if (host == partition_.self)
        around |= hosts_around(sector, sectors_, [](const SectorIndex&) { return true; });
    }
    around.erase(partition_.self);
    around.for_each([&](Rank rank) { outbox[rank].staged.push_back(parcel_for(rank)); });
    return around;
  }

 private:
  struct Known {
    const HomeBody* body;
    SeamStages stages = 0;
  };
  struct Found {
    Sector* sector;
    std::uint32_t pair;  // a place in the contacts of its world
    SeamContact contact;
  };
  using BlockPlace = std::pair<ContactStage, SectorIndex>;
  using Blocks = absl::flat_hash_set<BlockPlace>;

  // A contact that another sector has detected is known by the parts of both.
  void find_stages() {
    const auto note = [&](Known& known, const SectorIndex& other) {
      known.stages |= stage_bit(stage_of(known.body->sector->index, other, partition_.anchor));
    };
    for (const Found& found : contacts_) note(bodies_.at(found.contact.a), found.contact.home_b);
    for (const PartRef& ref : island_.parts) {
      for (const BodyId id : partition_.seam_graph.part(ref).shared) {
        const auto known = bodies_.find(id);
        if (known != bodies_.end() && ref.sector != known->second.body->sector->index) {
          note(known->second, ref.sector);
        }
      }
    }
  }

  BlockPlace block_with(const Known& known, ContactStage stage) const {
    return {stage, block_of(known.body->sector->index, stage, partition_.anchor)};
  }

  // Who hosts parts in a block with one of the bodies.
  const Ranks& hosts_of(const Known& known, ContactStage stage) {
    const auto [hosts, is_new] = hosts_.try_emplace(block_with(known, stage));
    if (is_new) hosts->second = hosts_of_block(known.body->sector->index, stage, sectors_, partition_.anchor);
    return hosts->second;
  }

  // The blocks with hosted bodies that the other server may solve.
  Blocks blocks_of(Rank rank) {
    Blocks blocks;
    for (ContactStage stage = kSeamStage + kSeamStages; stage-- > kSeamStage;) {
      for (const auto& [id, known] : bodies_) {
        if (!has_stage(known.stages, stage)) continue;
        if (hosts_of(known, stage).contains(rank)) blocks.insert(block_with(known, stage));
        if (!blocks.contains(block_with(known, stage))) continue;
        // It follows those in which what it solves later is pushed before.
        for (ContactStage earlier = kSeamStage; earlier < stage; ++earlier) {
          if (has_stage(known.stages, earlier) && may_follow(rank, partition_.self, hosts_of(known, earlier)))
            blocks.insert(block_with(known, earlier));
        }
      }
    }
    return blocks;
  }

  ShippedIsland parcel_for(Rank rank) {
    const Blocks blocks = blocks_of(rank);
    ShippedIsland parcel;
    parcel.island = island_.id;
    for (const auto& [id, known] : bodies_) {
      bool is_wanted = false;
      for (ContactStage stage = kSeamStage; stage < kSeamStage + kSeamStages; ++stage)
        is_wanted |= has_stage(known.stages, stage) && blocks.contains(block_with(known, stage));
      if (is_wanted) ship_body(*known.body, known.stages, parcel);
    }
    for (const Found& found : contacts_) {
      const ContactStage stage = stage_of(found.contact.home_a, found.contact.home_b, partition_.anchor);
      if (blocks.contains({stage, block_of(found.contact.home_a, stage, partition_.anchor)}))
        ship_pair(*found.sector, found.pair, parcel);
    }
    return parcel;
  }

  const Partition& partition_;
  const SeamIsland& island_;
  const IslandSectors& sectors_;
  std::map<BodyId, Known> bodies_;  // that others may touch, or that touch others
  std::vector<Found> contacts_;
  absl::flat_hash_map<BlockPlace, Ranks> hosts_;  // as hosts_of() found them
};

}  // namespace

void plan_stages(Partition& partition, TickContext& context, const SeamIsland& island, int substeps,
                 std::vector<Shipment>& outbox) {
  const StagedKind kind{substeps, island.bounces};
  StagedIslands& staged = context.plan.staged.try_emplace(kind, partition).first->second;
  IslandSectors& sectors = staged.islands[island.id];
  for (const PartRef& ref : island.parts) sectors.emplace(ref.sector, partition.map.owner(ref.sector));
  IslandAtSeams at_seams(partition, island, sectors);
  for (const PartRef& ref : island.parts) {
    if (!partition.hosts(ref.sector)) continue;
    Sector& sector = *partition.sectors.at(ref.sector);
    const Component& component = sector.components[sector.part_components[ref.part]];
    staged.builder.add(sector, component);
    at_seams.add_part(sector, component);
  }
  context.plan.in_step |= at_seams.tell(staged, outbox);
}

// Puts one job together: what is hosted here, and of what others told that which this server solves, too.
class StagedSolve::Builder {
 public:
  Builder(const Partition& partition, StagedIslands& staged, const std::vector<const ShippedIsland*>& told)
      : partition_(partition), staged_(staged) {
    homes_ = staged.own;
    for (const ShippedIsland* parcel : told) {
      for (std::size_t n = 0; n < parcel->bodies.size(); ++n) {
        const ShippedBody& body = parcel->bodies[n];
        if (!homes_.emplace(body.id, body.home).second) continue;
        bodies_.push_back({parcel, n});
        staged.seam_stages.emplace(body.id, body.seam_stages);
      }
    }
    for (const SeamContact& contact : staged.contacts) add_contact(contact, {});
    for (const ShippedIsland* parcel : told) {
      for (std::size_t n = 0; n < parcel->pairs.size(); ++n) {
        const ShippedPair& pair = parcel->pairs[n];
        add_contact({parcel->island, pair.a, pair.b, home_of(pair.a), home_of(pair.b)}, {parcel, n});
      }
    }
    follow();
  }

  Job build() {
    std::erase_if(contacts_, [&](const Contact& contact) {
      return !blocks_.at(contact.block).solvers.contains(partition_.self);
    });
    absl::flat_hash_set<BodyId> needed;
    for (const Contact& contact : contacts_) {
      needed.insert(contact.pair.a);
      needed.insert(contact.pair.b);
      if (contact.shipped.parcel != nullptr)
        staged_.builder.add_pair(*contact.shipped.parcel, contact.shipped.n);
    }
    for (const Shipped& body : bodies_) {
      if (needed.contains(body.parcel->bodies[body.n].id)) staged_.builder.add_body(*body.parcel, body.n);
    }
    staged_.builder.end_island();
    Job job;
    job.job = staged_.builder.build();
    direct_traffic(job);
    return job;
  }

 private:
  // Where contacts of an island are solved together. Later stages come first.
  struct Place {
    ContactStage stage = 0;
    BodyId island;
    SectorIndex index;

    friend bool operator<(const Place& a, const Place& b) {
      return std::tie(b.stage, a.island, a.index) < std::tie(a.stage, b.island, b.index);
    }
  };
  struct Block {
    Ranks solvers;  // who hosts a body in it, and who follows it
    std::vector<BodyId> bodies;
  };
  // A body or pair of a parcel.
  struct Shipped {
    const ShippedIsland* parcel = nullptr;
    std::size_t n = 0;
  };
  struct Contact {
    SeamContact pair;
    Place block;
    Shipped shipped;  // no parcel for one that was detected here
  };

  const SectorIndex& home_of(BodyId id) const {
    const auto home = homes_.find(id);
    invariant(home != homes_.end(), "bodies come with their contacts");
    return home->second;
  }
  Rank host_of(BodyId id) const { return partition_.map.owner(home_of(id)); }

  void add_contact(const SeamContact& pair, const Shipped& shipped) {
    const ContactStage stage = stage_of(pair.home_a, pair.home_b, partition_.anchor);
    invariant(is_seam_stage(stage), "islands with contacts of distant homes are not divided");
    const Place place{stage, pair.island, block_of(pair.home_a, stage, partition_.anchor)};
    contacts_.push_back({pair, place, shipped});
    Block& block = blocks_[place];
    block.solvers.insert(partition_.map.owner(pair.home_a));
    block.solvers.insert(partition_.map.owner(pair.home_b));
    block.bodies.push_back(pair.a);
    block.bodies.push_back(pair.b);
  }

  // A server that solves a block also solves those in which another's bodies in it are pushed before, if that
  // alone hosts these. So it need not be told of them again.
  void follow() {
    for (auto& [place, block] : blocks_) {
      for (const BodyId id : block.bodies) {
        const Rank host = host_of(id);
        const SectorIndex& home = home_of(id);
        for (ContactStage earlier = kSeamStage; earlier < place.stage; ++earlier) {
          if (!has_stage(staged_.seam_stages.at(id), earlier)) continue;
          const auto pushed =
              blocks_.find({earlier, place.island, block_of(home, earlier, partition_.anchor)});
          if (pushed == blocks_.end()) continue;
          const Ranks hosts =
              hosts_of_block(home, earlier, staged_.islands.at(place.island), partition_.anchor);
          // Others do not concern this server, nor would it know all.
          const auto add_follower = [&](Rank rank) {
            if (may_follow(rank, host, hosts)) pushed->second.solvers.insert(rank);
          };
          if (host == partition_.self) {
            block.solvers.for_each(add_follower);
          } else if (block.solvers.contains(partition_.self)) {
            add_follower(partition_.self);
          }
        }
      }
    }
  }

  // The stages in which two servers both solve a body's contacts; a bit each.
  struct Shared {
    SeamStages stages = 0;
    Rank host = 0;  // of the body
  };
  using SharedByBody = std::map<BodyId, Shared>;

  void direct_traffic(Job& job) const {
    for (TrafficByRank& traffic : job.traffic) traffic.resize(partition_.map.servers());
    std::vector<SharedByBody> shared(partition_.map.servers());  // by the other server
    for (const Contact& contact : contacts_) {
      const Ranks others = blocks_.at(contact.block).solvers - Ranks{partition_.self};
      for (const auto& [id, home] :
           {std::pair(contact.pair.a, contact.pair.home_a), {contact.pair.b, contact.pair.home_b}}) {
        const Rank host = partition_.map.owner(home);
        (host == partition_.self ? others : Ranks{host}).for_each([&](Rank rank) {
          Shared& body = shared[rank][id];
          body.stages |= stage_bit(contact.block.stage);
          body.host = host;
        });
      }
    }
    for (Rank rank = 0; rank < shared.size(); ++rank) direct_traffic(shared[rank], rank, job);
  }

  // In as few exchanges as possible. A body that both push in a stage must be told of after the last push
  // that only its host knows of, and before that stage: an exchange for each of these intervals, the earliest
  // end first. Both servers come to the same.
  void direct_traffic(const SharedByBody& shared, Rank rank, Job& job) const {
    std::array<int, kSeamStages> latest{};  // by stage: the last exchange up to it
    int last = -1;
    for (int n = 0; n < kSeamStages; ++n) {
      for (const auto& [id, body] : shared) {
        if (has_stage(body.stages, static_cast<ContactStage>(kSeamStage + n)) &&
            last <= last_private_push(id, body, n))
          last = n;
      }
      latest[n] = last;
    }
    for (const auto& [id, body] : shared) {
      const std::optional<std::size_t> place = staged_.builder.place_of(id);
      invariant(place.has_value(), "the bodies of a contact are in its task");
      int told = -1;  // in the exchange before this stage
      for (int n = 0; n < kSeamStages; ++n) {
        if (!has_stage(body.stages, static_cast<ContactStage>(kSeamStage + n)) ||
            told > last_private_push(id, body, n))
          continue;
        told = latest[n];
        Traffic& traffic = job.traffic[told][rank];
        (body.host == partition_.self ? traffic.mine : traffic.theirs).push_back(*place);
      }
    }
  }

  // The last stage before this one in which only the body's host knows what happens to it, counted from the
  // first stage of seams; -1: the contacts inside its sector.
  int last_private_push(BodyId id, const Shared& body, int stage) const {
    const int pushed = staged_.seam_stages.at(id) & ~body.stages & ((1 << stage) - 1);
    return std::bit_width(static_cast<unsigned>(pushed)) - 1;
  }

  const Partition& partition_;
  StagedIslands& staged_;
  absl::flat_hash_map<BodyId, SectorIndex> homes_;
  std::vector<Shipped> bodies_;  // of others
  std::vector<Contact> contacts_;
  std::map<Place, Block> blocks_;
};

StagedSolve::StagedSolve(const Partition& partition, IslandPlan& plan, const std::vector<Shipment>& inbox,
                         std::vector<std::unique_ptr<StagedSolver>>& solvers)
    : servers_(partition.map.servers()) {
  absl::flat_hash_map<BodyId, std::vector<const ShippedIsland*>> told;  // by island
  for (const Shipment& message : inbox) {
    for (const ShippedIsland& island : message.staged) told[island.island].push_back(&island);
  }
  jobs_.reserve(plan.staged.size());
  while (solvers.size() < plan.staged.size()) solvers.push_back(partition.engine.make_staged_solver());
  for (auto& [kind, staged] : plan.staged) {
    std::vector<const ShippedIsland*> parcels;
    for (const auto& [island, sectors] : staged.islands) {
      parcels.insert(parcels.end(), told[island].begin(), told[island].end());
    }
    Job& job = jobs_.emplace_back(Builder(partition, staged, parcels).build());
    job.solver = solvers[jobs_.size() - 1].get();
    job.sweeps =
        job.solver->begin(job.job.task, partition.dt(), {job.job.stage_ends, kind.substeps, kind.bounces});
    sweeps_ = std::max(sweeps_, job.sweeps);
  }
}

auto StagedSolve::traffic_of(const Job& job) const -> const TrafficByRank* {
  return is_seam_stage(stage_) && sweep_ < job.sweeps ? &job.traffic[stage_ - kSeamStage] : nullptr;
}

std::optional<Round> StagedSolve::exchange() const {
  Round round = make_round(RoundKind::kMotions, servers_,
                           static_cast<std::uint32_t>(sweep_) * kSeamStages + (stage_ - kSeamStage));
  bool has_any = false;
  for (Rank rank = 0; rank < servers_; ++rank) {
    Motions motions;
    for (const Job& job : jobs_) {
      const TrafficByRank* traffic = traffic_of(job);
      if (traffic == nullptr) continue;
      if (!(*traffic)[rank].theirs.empty()) round.from[rank] = true;
      for (const std::size_t body : (*traffic)[rank].mine)
        job.solver->append_motion(sweep_, body, motions.bytes);
    }
    has_any |= round.from[rank] || !motions.bytes.empty();
    if (!motions.bytes.empty()) round.to[rank] = std::move(motions);
  }
  if (!has_any) return std::nullopt;
  return round;
}

void StagedSolve::take(const std::vector<Motions>& inbox) {
  for (Rank rank = 0; rank < servers_; ++rank) {
    std::string_view bytes = inbox[rank].bytes;
    for (const Job& job : jobs_) {
      const TrafficByRank* traffic = traffic_of(job);
      if (traffic == nullptr) continue;
      const std::size_t size = job.solver->motion_size(sweep_);
      for (const std::size_t body : (*traffic)[rank].theirs) {
        invariant(bytes.size() >= size, "motions are of the bodies that both servers know");
        job.solver->set_motion(sweep_, body, bytes.substr(0, size));
        bytes.remove_prefix(size);
      }
    }
    invariant(bytes.empty(), "motions are of the bodies that both servers know");
  }
  is_told_ = true;
}

void StagedSolve::solve_next_stage() {
  for (const Job& job : jobs_) {
    if (sweep_ < job.sweeps) job.solver->solve_stage(sweep_, stage_);
  }
}

std::optional<Round> StagedSolve::go_on() {
  for (; sweep_ < sweeps_; ++sweep_) {
    for (; stage_ < kContactStages; ++stage_) {
      if (!is_told_ && is_seam_stage(stage_)) {
        if (std::optional<Round> round = exchange()) return round;
      }
      solve_next_stage();
      is_told_ = false;
    }
    stage_ = 0;
  }
  for (const Job& job : jobs_) job.solver->end();
  jobs_.clear();
  return std::nullopt;
}

}  // namespace tessera
