#include "lpss/observe/load.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <optional>
#include <queue>

namespace tessera {
namespace {

// In units of one awake body's.
constexpr double kWorkOfSector = 4;  // that the tick looks at
constexpr double kWorkOfPair = 2;

// Of more sectors than this, those at rest are counted by a sample.
constexpr std::size_t kCountedMax = 16'384;

using LoadBySector = absl::flat_hash_map<SectorIndex, LoadPiece>;

// The sector in which the body will be in `ahead` seconds; its own where that is none of the world's.
SectorIndex sector_ahead(const Partition& partition, const HomeBody& body, double ahead) {
  const SectorWorld& world = *body.sector->world;
  const absl::StatusOr<WorldPosition> position =
      canonical(body.sector->index, world.position(body.slot) + world.linear_velocity(body.slot) * ahead,
                partition.sector_size());
  return position.ok() ? position->sector : body.sector->index;
}

void add_work(const Partition& partition, const Sector& sector, double ahead, LoadBySector& load) {
  if (!sector.world) return;
  std::vector<const HomeBody*> awake;
  for (const HomeBody* body : sector.homes) {
    if (sector.world->activity(body->slot) != Activity::kAsleep) awake.push_back(body);
  }
  const double others = kWorkOfSector + kWorkOfPair * static_cast<double>(sector.world->contacts().size());
  if (awake.empty() || ahead == 0) {
    load[sector.index].work += static_cast<double>(awake.size()) + others;
    return;
  }
  const double share = 1 + others / static_cast<double>(awake.size());
  for (const HomeBody* body : awake) load[sector_ahead(partition, *body, ahead)].work += share;
}

void count_sectors(const Partition& partition, LoadBySector& load) {
  const std::uint64_t stride =
      (partition.sectors.size() + partition.packed.counts().sectors) / kCountedMax + 1;
  const auto add = [&](const SectorIndex& index, std::size_t bodies) {
    if (stride > 1 && absl::HashOf(index) % stride != 0) return;
    LoadPiece& piece = load[index];
    piece.sectors += stride;
    piece.bodies += stride * bodies;
  };
  for (const auto& [index, sector] : partition.sectors) add(index, sector->homes.size());
  partition.packed.for_each(add);
}

// Consecutive sectors on the curve that fill a cube, as far as they are there.
struct Block {
  std::size_t begin = 0;  // of the sectors on the curve
  std::size_t end = 0;
  bool is_mixed = false;  // its sectors have several owners
  double share = 0;       // of all work and of all sectors

  friend bool operator<(const Block& a, const Block& b) {
    if (a.is_mixed != b.is_mixed) return b.is_mixed;
    return a.share != b.share ? a.share < b.share : a.begin > b.begin;
  }
};

// Cuts sectors along the curve into cubes, the heaviest ones into smaller ones. Work and the number of
// sectors count alike, since those at rest have no work.
class CurvePieces {
 public:
  CurvePieces(const Partition& partition, const std::vector<LoadPiece>& sectors)
      : anchor_(partition.anchor), sectors_(sectors) {
    double work = 0;
    double count = 0;
    for (const LoadPiece& sector : sectors_) {
      work += sector.work;
      count += static_cast<double>(sector.sectors);
    }
    std::optional<Rank> before;
    for (const LoadPiece& sector : sectors_) {
      const double by_work = work > 0 ? sector.work / work : 0;
      const double by_count = count > 0 ? static_cast<double>(sector.sectors) / count : 0;
      shares_.push_back(shares_.back() + by_work + by_count);
      const Rank owner = partition.map.owner(sector.first);
      changes_.push_back(changes_.back() + (before && before != owner ? 1 : 0));
      before = owner;
    }
  }

  std::vector<LoadPiece> at_most(std::size_t pieces_max) {
    if (sectors_.empty()) return {};
    std::priority_queue<Block> open({}, {block(0, sectors_.size())});
    std::vector<Block> closed;
    while (!open.empty()) {
      const Block heaviest = open.top();
      open.pop();
      const std::vector<Block> parts = parts_of(heaviest);
      // No piece has sectors of several frames: the first cut, if any, is between these.
      const bool has_room = closed.size() + open.size() + parts.size() <= pieces_max;
      if (parts.size() < 2 || (!has_room && level_of(heaviest) <= kCurveLevelMax)) {
        closed.push_back(heaviest);
      } else {
        for (const Block& part : parts) open.push(part);
      }
    }
    std::ranges::sort(closed, {}, &Block::begin);
    std::vector<LoadPiece> pieces;
    for (const Block& one : closed) pieces.push_back(sum_of(one));
    return pieces;
  }

 private:
  Block block(std::size_t begin, std::size_t end) const {
    return {begin, end, changes_[end] > changes_[begin + 1], shares_[end] - shares_[begin]};
  }

  unsigned level_of(const Block& one) const {
    return common_level(sectors_[one.begin].first, sectors_[one.end - 1].first, anchor_);
  }

  // The cubes of the next lower level that it has sectors in.
  std::vector<Block> parts_of(const Block& whole) const {
    std::vector<Block> parts;
    const unsigned level = level_of(whole);
    if (level == 0) return parts;
    for (std::size_t begin = whole.begin; begin < whole.end;) {
      const std::optional<SectorIndex> after = first_after_cube(sectors_[begin].first, level - 1, anchor_);
      std::size_t end = whole.end;
      if (after) {
        const auto from = sectors_.begin() + static_cast<std::ptrdiff_t>(begin);
        const auto to = sectors_.begin() + static_cast<std::ptrdiff_t>(whole.end);
        const auto next = std::partition_point(from, to, [&](const LoadPiece& sector) {
          return comes_before_on_curve(sector.first, *after, anchor_);
        });
        end = static_cast<std::size_t>(next - sectors_.begin());
      }
      parts.push_back(block(begin, end));
      begin = end;
    }
    return parts;
  }

  LoadPiece sum_of(const Block& one) const {
    LoadPiece piece{.first = sectors_[one.begin].first, .level = level_of(one)};
    for (std::size_t n = one.begin; n < one.end; ++n) {
      piece.work += sectors_[n].work;
      piece.sectors += sectors_[n].sectors;
      piece.bodies += sectors_[n].bodies;
    }
    return piece;
  }

  const SectorIndex& anchor_;
  const std::vector<LoadPiece>& sectors_;     // single ones, in the order of the curve
  std::vector<double> shares_ = {0};          // sums of those before
  std::vector<std::uint64_t> changes_ = {0};  // of owners, up to this one
};

}  // namespace

std::vector<LoadPiece> load_along_curve(const Partition& partition, double ahead, std::size_t pieces_max) {
  LoadBySector by_sector;
  for (const Sector* sector : partition.active) add_work(partition, *sector, ahead, by_sector);
  count_sectors(partition, by_sector);
  std::vector<LoadPiece> sectors;
  sectors.reserve(by_sector.size());
  for (auto& [index, load] : by_sector) {
    load.first = index;
    sectors.push_back(load);
  }
  std::sort(sectors.begin(), sectors.end(), [&](const LoadPiece& a, const LoadPiece& b) {
    return comes_before_on_curve(a.first, b.first, partition.anchor);
  });
  return CurvePieces(partition, sectors).at_most(pieces_max);
}

}  // namespace tessera
