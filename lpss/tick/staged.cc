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

bool is_seam_group(ContactGroup group) { return group >= kSeamGroup && group < kSeamGroup + kSeamGroups; }

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

const HomeBody* home_in_slot(const Sector& sector, BodySlot slot) {
  const auto place = static_cast<std::size_t>(slot);
  return place < sector.by_slot.size() ? sector.by_slot[place] : nullptr;
}

}  // namespace

Ranks hosts_around(const SectorIndex& sector, const IslandSectors& sectors, Rank self) {
  Ranks hosts = 0;
  for_each_around(sector, [&](const SectorIndex& other) {
    const auto host = sectors.find(other);
    if (host != sectors.end() && host->second != self) hosts |= Ranks{1} << host->second;
  });
  return hosts;
}

namespace {

// What others must know of the bodies of one part.
class PartAtSeams {
 public:
  PartAtSeams(const Partition& partition, Sector& sector, const Component& component)
      : partition_(partition), sector_(sector), component_(component) {
    for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
      const HomeBody& body = *sector.component_bodies[i];
      if (!body.replicated_in.empty()) known_.emplace(body.id, Known{&body});
    }
  }

  // Calls visit(place, the body that lives here, the replica that it touches) for each contact over a seam.
  template <typename Visit>
  void find_own_contacts(const Visit& visit) {
    const std::span<const ContactPair> pairs = sector_.world->contacts();
    for (std::uint32_t i = component_.pairs_begin; i < component_.pairs_end; ++i) {
      const std::uint32_t n = sector_.component_pairs[i];
      const ContactPair& pair = pairs[n];
      const HomeBody* const home_a = home_in_slot(sector_, pair.slot_a);
      const HomeBody* const home_b = home_in_slot(sector_, pair.slot_b);
      if ((home_a == nullptr) == (home_b == nullptr)) continue;
      const HomeBody& body = home_a != nullptr ? *home_a : *home_b;
      const auto clone = sector_.clones.find(home_a != nullptr ? pair.b : pair.a);
      if (clone == sector_.clones.end()) continue;  // a static body
      const Replica& other = *clone->second.replica;
      if (body.properties.motion != Motion::kDynamic || other.properties.motion != Motion::kDynamic) continue;
      note(known_.try_emplace(body.id, Known{&body}).first->second, other.home);
      visit(n, body, other);
    }
  }

  // Contacts that other sectors have detected: their parts name the bodies.
  void find_contacts_elsewhere(const SeamIsland& island) {
    for (const PartRef& ref : island.parts) {
      if (chebyshev_distance(ref.sector, sector_.index) != 1) continue;
      for (const BodyId link : partition_.seam_graph.part(ref).links) {
        if (const auto known = known_.find(link); known != known_.end()) note(known->second, ref.sector);
      }
    }
  }

  std::vector<ShippedBody> bodies() const {
    std::vector<ShippedBody> bodies;
    for (const auto& [id, known] : known_) {
      const Wrench wrench = sector_.world->total_wrench(known.body->slot);
      bodies.push_back({record_of(*known.body), wrench, known.seam_groups});
    }
    return bodies;
  }

 private:
  struct Known {
    const HomeBody* body;
    std::uint8_t seam_groups = 0;
  };

  void note(Known& known, const SectorIndex& other) const {
    const ContactGroup group = group_of(sector_.index, other, partition_.anchor);
    known.seam_groups |= static_cast<std::uint8_t>(1 << (group - kSeamGroup));
  }

  const Partition& partition_;
  Sector& sector_;
  const Component& component_;
  std::map<BodyId, Known> known_;  // that others may touch, or that touch others
};

}  // namespace

void stage_part(const Partition& partition, Sector& sector, const Component& component,
                const SeamIsland& island, const IslandSectors& sectors, StagedIslands& staged,
                std::vector<Shipment>& outbox) {
  add_component(partition, sector, component, staged.builder, false);
  const Ranks around = hosts_around(sector.index, sectors, partition.self);
  if (around == 0) return;

  std::vector<ShippedIsland> parcels(outbox.size());
  PartAtSeams part(partition, sector, component);
  part.find_own_contacts([&](std::uint32_t n, const HomeBody& body, const Replica& other) {
    staged.contacts.push_back({island.id, body.id, other.id, sector.index, other.home});
    const ContactGroup group = group_of(sector.index, other.home, partition.anchor);
    const SectorIndex block = block_of(sector.index, group, partition.anchor);
    Ranks hosts = 0;
    for_each_around(sector.index, [&](const SectorIndex& near) {
      const auto host = sectors.find(near);
      if (host == sectors.end() || host->second == partition.self) return;
      if (block_of(near, group, partition.anchor) == block) hosts |= Ranks{1} << host->second;
    });
    if (hosts == 0) return;
    const ShippedContact shipped{sector.index, sector.world->export_manifold(n)};
    for_each_rank(hosts, [&](Rank rank) { parcels[rank].contacts.push_back(shipped); });
  });
  part.find_contacts_elsewhere(island);
  for (const ShippedBody& body : part.bodies()) {
    for_each_rank(around, [&](Rank rank) { parcels[rank].bodies.push_back(body); });
    staged.own.emplace(body.record.id, body.record);
    staged.seam_groups.emplace(body.record.id, body.seam_groups);
  }
  for_each_rank(around, [&](Rank rank) {
    parcels[rank].island = island.id;
    outbox[rank].staged.push_back(std::move(parcels[rank]));
  });
}

// Puts one job together: what is hosted here, and of what others told that which this server takes part in.
class StagedSolve::Builder {
 public:
  Builder(const Partition& partition, StagedIslands& staged,
          const std::vector<std::vector<const ShippedIsland*>>& told)
      : partition_(partition), staged_(staged) {
    for (const auto& [id, record] : staged.own) homes_.emplace(id, record.home);
    for (const auto& parcels : told) {
      for (const ShippedIsland* parcel : parcels) {
        for (const ShippedBody& body : parcel->bodies) {
          if (!homes_.emplace(body.record.id, body.record.home).second) continue;
          bodies_.push_back(&body);
          staged.seam_groups.emplace(body.record.id, body.seam_groups);
        }
      }
    }
    for (const SeamContact& contact : staged.contacts) add_contact(contact, nullptr);
    for (const auto& parcels : told) {
      for (const ShippedIsland* parcel : parcels) {
        for (const ShippedContact& contact : parcel->contacts) {
          const ManifoldState& pair = contact.manifold;
          add_contact({parcel->island, pair.a, pair.b, home_of(pair.a), home_of(pair.b)}, &contact);
        }
      }
    }
  }

  Job build() {
    std::erase_if(contacts_, [&](const Contact& contact) {
      return (hosts_.at(contact.block) & bit(partition_.self)) == 0;
    });
    std::vector<const ShippedContact*> foreign;
    absl::flat_hash_set<BodyId> needed;
    for (const Contact& contact : contacts_) {
      needed.insert(contact.pair.a);
      needed.insert(contact.pair.b);
      if (contact.shipped != nullptr) foreign.push_back(contact.shipped);
    }
    std::erase_if(bodies_, [&](const ShippedBody* body) { return !needed.contains(body->record.id); });
    Job job;
    job.carriers = std::make_unique<Carriers>(partition_.engine, partition_.sector_size(), bodies_,
                                              std::move(foreign), staged_.own, staged_.builder);
    job.job = build_job(partition_, staged_.builder);
    direct_traffic(job);
    return job;
  }

 private:
  // Where contacts of an island are solved together.
  struct Block {
    BodyId island;
    ContactGroup group = 0;
    SectorIndex index;

    friend bool operator==(const Block&, const Block&) = default;
    template <typename H>
    friend H AbslHashValue(H h, const Block& b) {
      return H::combine(std::move(h), b.island.value, b.group, b.index);
    }
  };
  struct Contact {
    SeamContact pair;
    Block block;
    const ShippedContact* shipped;  // null for one that was detected here
  };

  static Ranks bit(Rank rank) { return Ranks{1} << rank; }

  const SectorIndex& home_of(BodyId id) const {
    const auto home = homes_.find(id);
    invariant(home != homes_.end(), "bodies come with their contacts");
    return home->second;
  }

  void add_contact(const SeamContact& pair, const ShippedContact* shipped) {
    const ContactGroup group = group_of(pair.home_a, pair.home_b, partition_.anchor);
    invariant(is_seam_group(group), "islands with contacts of distant homes are not divided");
    const Block block{pair.island, group, block_of(pair.home_a, group, partition_.anchor)};
    contacts_.push_back({pair, block, shipped});
    hosts_[block] |= bit(partition_.map.owner(pair.home_a)) | bit(partition_.map.owner(pair.home_b));
  }

  // The groups in which two servers both solve a body's contacts; a bit each.
  struct Shared {
    std::uint8_t groups = 0;
    Rank host = 0;  // of the body
  };
  using SharedByBody = std::map<BodyId, Shared>;

  void direct_traffic(Job& job) const {
    for (TrafficByRank& traffic : job.traffic) traffic.resize(partition_.map.servers());
    std::vector<SharedByBody> shared(partition_.map.servers());  // by the other server
    for (const Contact& contact : contacts_) {
      const auto group = static_cast<std::uint8_t>(1 << (contact.block.group - kSeamGroup));
      const Ranks others = hosts_.at(contact.block) & ~bit(partition_.self);
      for (const auto& [id, home] :
           {std::pair(contact.pair.a, contact.pair.home_a), {contact.pair.b, contact.pair.home_b}}) {
        const Rank host = partition_.map.owner(home);
        for_each_rank(host == partition_.self ? others : bit(host), [&](Rank rank) {
          Shared& body = shared[rank][id];
          body.groups |= group;
          body.host = host;
        });
      }
    }
    for (Rank rank = 0; rank < shared.size(); ++rank) direct_traffic(shared[rank], rank, job);
  }

  // In as few exchanges as possible. A body that both push in a group must be told of after the last push
  // that only its host knows of, and before that group: an exchange for each of these intervals, the earliest
  // end first. Both servers come to the same.
  void direct_traffic(const SharedByBody& shared, Rank rank, Job& job) const {
    std::array<int, kSeamGroups> latest{};  // by group: the last exchange up to it
    int last = -1;
    for (int group = 0; group < kSeamGroups; ++group) {
      for (const auto& [id, body] : shared) {
        if (is_in(body.groups, group) && last <= last_private_push(id, body, group)) last = group;
      }
      latest[group] = last;
    }
    for (const auto& [id, body] : shared) {
      const std::optional<std::size_t> place = staged_.builder.place_of(id);
      invariant(place.has_value(), "the bodies of a contact are in its task");
      int told = -1;  // in the exchange before this group
      for (int group = 0; group < kSeamGroups; ++group) {
        if (!is_in(body.groups, group) || told > last_private_push(id, body, group)) continue;
        told = latest[group];
        Traffic& traffic = job.traffic[told][rank];
        (body.host == partition_.self ? traffic.mine : traffic.theirs).push_back(*place);
      }
    }
  }

  static bool is_in(std::uint8_t groups, int group) { return ((groups >> group) & 1) != 0; }

  // The last group before this one in which only the body's host knows what happens to it; -1: the contacts
  // inside its sector.
  int last_private_push(BodyId id, const Shared& body, int group) const {
    const int pushed = staged_.seam_groups.at(id) & ~body.groups & ((1 << group) - 1);
    return std::bit_width(static_cast<unsigned>(pushed)) - 1;
  }

  const Partition& partition_;
  StagedIslands& staged_;
  absl::flat_hash_map<BodyId, SectorIndex> homes_;
  std::vector<const ShippedBody*> bodies_;  // of others
  std::vector<Contact> contacts_;
  absl::flat_hash_map<Block, Ranks> hosts_;  // of bodies in its contacts
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
    std::vector<std::vector<const ShippedIsland*>> parcels;
    for (const BodyId island : staged.islands) parcels.push_back(std::move(told[island]));
    Job& job = jobs_.emplace_back(Builder(partition, staged, parcels).build());
    job.solver = solvers[jobs_.size() - 1].get();
    job.sweeps =
        job.solver->begin(job.job.task, partition.dt(), {job.job.group_ends, kind.substeps, kind.bounces});
    sweeps_ = std::max(sweeps_, job.sweeps);
  }
}

auto StagedSolve::traffic_of(const Job& job) const -> const TrafficByRank* {
  return is_seam_group(group_) && sweep_ < job.sweeps ? &job.traffic[group_ - kSeamGroup] : nullptr;
}

std::optional<Round> StagedSolve::exchange() const {
  Round round = make_round(RoundKind::kMotions, servers_,
                           static_cast<std::uint32_t>(sweep_) * kSeamGroups + (group_ - kSeamGroup));
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

void StagedSolve::solve_group() {
  for (const Job& job : jobs_) {
    if (sweep_ < job.sweeps) job.solver->solve_stage(sweep_, group_);
  }
}

std::optional<Round> StagedSolve::go_on() {
  for (; sweep_ < sweeps_; ++sweep_) {
    for (; group_ < kContactGroups; ++group_) {
      if (!is_told_ && is_seam_group(group_)) {
        if (std::optional<Round> round = exchange()) return round;
      }
      solve_group();
      is_told_ = false;
    }
    group_ = 0;
  }
  for (const Job& job : jobs_) job.solver->end();
  jobs_.clear();
  return std::nullopt;
}

}  // namespace tessera
