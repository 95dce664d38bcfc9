#include "lpss/world/share_cluster.h"

#include <absl/strings/str_cat.h>

#include "lpss/engine/load_engine.h"

namespace tessera {
namespace {

// What each share sent, turned round to what each receives.
template <typename Message>
std::vector<std::vector<Message>> transposed(std::vector<std::vector<Message>> sent) {
  std::vector<std::vector<Message>> received(sent.size());
  for (std::size_t to = 0; to < sent.size(); ++to) {
    for (std::vector<Message>& outbox : sent) received[to].push_back(std::move(outbox[to]));
  }
  return received;
}

}  // namespace

absl::StatusOr<std::unique_ptr<ShareCluster>> ShareCluster::create(const WorldDescription& world,
                                                                   std::uint32_t shares, int threads) {
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  if (!records.ok()) return records.status();
  const SectorMap map = placed(world, *records, shares, 1);
  std::unique_ptr<ShareCluster> cluster(new ShareCluster());
  for (Rank rank = 0; rank < shares; ++rank) {
    absl::StatusOr<std::unique_ptr<Engine>> engine = load_engine(engine_settings(world.settings));
    if (!engine.ok()) return engine.status();
    cluster->engines_.push_back(std::move(*engine));
    Share::Options options{world.settings, world.anchor, map, rank, parallel_on(threads)};
    auto share = std::make_unique<Share>(std::move(options), *cluster->engines_.back());
    for (std::size_t i = 0; i < world.shapes.size(); ++i) {
      share->add_shape(static_cast<ShapeId>(i), world.shapes[i]);
    }
    for (const BodyRecord& record : *records) share->add_body(record);
    cluster->shares_.push_back(std::move(share));
  }
  return cluster;
}

void ShareCluster::step(std::span<const Command> commands) {
  ++tick_;
  std::vector<std::vector<Exchange>> exchanges;
  for (auto& share : shares_) exchanges.push_back(share->begin_tick(commands));
  exchanges = transposed(std::move(exchanges));

  std::vector<Seams> seams;
  for (Rank rank = 0; rank < shares_.size(); ++rank) seams.push_back(shares_[rank]->detect(std::move(exchanges[rank])));
  std::vector<const Seams*> heard;
  for (const Seams& message : seams) heard.push_back(&message);

  std::vector<std::vector<Shipment>> shipments;
  for (auto& share : shares_) shipments.push_back(share->join(heard));
  shipments = transposed(std::move(shipments));
  std::vector<std::vector<Solution>> solutions;
  for (Rank rank = 0; rank < shares_.size(); ++rank) solutions.push_back(shares_[rank]->solve(std::move(shipments[rank])));
  solutions = transposed(std::move(solutions));
  for (Rank rank = 0; rank < shares_.size(); ++rank) shares_[rank]->finish(std::move(solutions[rank]));
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
