#include "lpss/simulation/share_cluster.h"

#include <absl/strings/str_cat.h>

#include <map>

#include "lpss/engine/load_engine.h"

namespace tessera {

absl::StatusOr<std::unique_ptr<ShareCluster>> ShareCluster::create(const WorldDescription& world,
                                                                   std::uint32_t shares, int threads,
                                                                   bool lone_bodies_coast) {
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  if (!records.ok()) return records.status();
  const absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(world);
  if (!joints.ok()) return joints.status();
  const SectorMap map = placed(world, *records, shares, 1);
  std::unique_ptr<ShareCluster> cluster(new ShareCluster());
  for (Rank rank = 0; rank < shares; ++rank) {
    absl::StatusOr<std::unique_ptr<Engine>> engine = load_engine(engine_settings(world.settings));
    if (!engine.ok()) return engine.status();
    cluster->engines_.push_back(std::move(*engine));
    Share::Options options;
    options.settings = world.settings;
    options.anchor = world.anchor;
    options.map = map;
    options.self = rank;
    options.parallel = parallel_on(threads);
    options.lone_bodies_coast = lone_bodies_coast;
    auto share = std::make_unique<Share>(std::move(options), *cluster->engines_.back());
    for (std::size_t i = 0; i < world.shapes.size(); ++i) {
      share->add_shape(static_cast<ShapeId>(i), world.shapes[i]);
    }
    for (const BodyRecord& record : *records) share->add_body(record);
    for (const JointRecord& joint : *joints) share->add_joint(joint);
    cluster->shares_.push_back(std::move(share));
  }
  return cluster;
}

// Lets every share go on as soon as it has heard whom it waits for.
void ShareCluster::step(std::span<const Command> commands) {
  ++tick_;
  using Inbox = std::vector<std::optional<RoundMessage>>;
  std::vector<std::optional<Round>> rounds(shares_.size());
  std::map<std::pair<std::uint32_t, Rank>, Inbox> inboxes;  // by number of the round and receiver
  const auto inbox_of = [&](std::uint32_t number, Rank rank) -> Inbox& {
    Inbox& inbox = inboxes[{number, rank}];
    inbox.resize(shares_.size());
    return inbox;
  };
  const auto post = [&](Rank from) {
    if (!rounds[from]) return;
    for (Rank to = 0; to < shares_.size(); ++to) {
      if (rounds[from]->to[to]) inbox_of(rounds[from]->number, to)[from] = std::move(rounds[from]->to[to]);
    }
  };
  for (Rank rank = 0; rank < shares_.size(); ++rank) {
    rounds[rank] = shares_[rank]->begin_tick(commands);
    post(rank);
  }
  for (bool moved = true; moved;) {
    moved = false;
    for (Rank rank = 0; rank < shares_.size(); ++rank) {
      if (!rounds[rank]) continue;
      Inbox& inbox = inbox_of(rounds[rank]->number, rank);
      bool complete = true;
      for (Rank from = 0; from < shares_.size(); ++from) complete &= !rounds[rank]->from[from] || inbox[from];
      if (!complete) continue;
      rounds[rank] = shares_[rank]->advance(std::move(inbox));
      post(rank);
      moved = true;
    }
  }
}

WorldHash ShareCluster::hash() const {
  WorldHash sum;
  for (const auto& share : shares_) sum.add(share->hash());
  return sum;
}

TickCounts ShareCluster::counts() const {
  TickCounts sum;
  for (const auto& share : shares_) sum += share->counts();
  return sum;
}

absl::StatusOr<BodyRecord> ShareCluster::body(BodyId id) const {
  for (const auto& share : shares_) {
    if (const std::optional<BodyRecord> record = share->body(id)) return *record;
  }
  return absl::NotFoundError(absl::StrCat("no moving body with the id ", id.value));
}

}  // namespace tessera
