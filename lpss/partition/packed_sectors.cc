#include "lpss/partition/packed_sectors.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "lpss/base/bytes.h"
#include "lpss/base/invariant.h"
#include "lpss/partition/moved_sector.h"

namespace tessera {
namespace {

// Changes are kept up to as many as there are sectors, or so many: whoever never asks costs no more.
constexpr std::size_t kChangesKept = 4096;

// Numbers of any size: seven bits a byte, the last byte below 128.
class PackWriter {
 public:
  explicit PackWriter(std::string& bytes) : bytes_(bytes), write_(bytes) {}

  void count(std::uint64_t value) const {
    for (; value >= 128; value >>= 7) write_(static_cast<std::uint8_t>(value | 128));
    write_(static_cast<std::uint8_t>(value));
  }
  void difference(std::int64_t value) const {
    count(static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63));
  }
  // Most numbers of a body at rest are 0, or floats: two bits say which, four numbers a byte.
  void numbers(std::span<const double> values) const {
    for (std::size_t begin = 0; begin < values.size(); begin += 4) {
      const std::span<const double> four =
          values.subspan(begin, std::min<std::size_t>(4, values.size() - begin));
      std::uint8_t kinds = 0;
      for (std::size_t n = 0; n < four.size(); ++n)
        kinds |= static_cast<std::uint8_t>(kind_of(four[n]) << (2 * n));
      write_(kinds);
      for (const double value : four) {
        if (kind_of(value) == kFloat) write_(static_cast<float>(value));
        if (kind_of(value) == kDouble) write_(value);
      }
    }
  }
  // Of eight bytes each, a byte that says which are not 0, and those: contact points are half zeros.
  void text(std::string_view text) const {
    count(text.size());
    for (; !text.empty(); text.remove_prefix(std::min<std::size_t>(8, text.size()))) {
      const std::string_view eight = text.substr(0, 8);
      const std::size_t place = bytes_.size();
      bytes_.push_back(0);
      for (std::size_t n = 0; n < eight.size(); ++n) {
        if (eight[n] == 0) continue;
        bytes_[place] = static_cast<char>(bytes_[place] | 1 << n);
        bytes_.push_back(eight[n]);
      }
    }
  }

  static constexpr unsigned kZero = 0;
  static constexpr unsigned kFloat = 1;
  static constexpr unsigned kDouble = 2;

 private:
  static unsigned kind_of(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    if (bits == 0) return kZero;
    return std::bit_cast<std::uint64_t>(static_cast<double>(static_cast<float>(value))) == bits ? kFloat
                                                                                                : kDouble;
  }

  std::string& bytes_;
  ByteWriter write_;
};

class PackReader {
 public:
  explicit PackReader(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t count() {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = get<std::uint8_t>();
      value |= static_cast<std::uint64_t>(byte & 127) << shift;
      if (byte < 128) return value;
    }
  }
  std::int64_t difference() {
    const std::uint64_t value = count();
    return static_cast<std::int64_t>(value >> 1 ^ (~(value & 1) + 1));
  }
  void numbers(std::span<double> values) {
    for (std::size_t begin = 0; begin < values.size(); begin += 4) {
      const auto kinds = get<std::uint8_t>();
      for (std::size_t n = 0; n < 4 && begin + n < values.size(); ++n) {
        const unsigned kind = kinds >> (2 * n) & 3;
        double& value = values[begin + n];
        value = kind == PackWriter::kFloat ? get<float>() : kind == PackWriter::kDouble ? get<double>() : 0;
      }
    }
  }
  std::string text() {
    std::string text(count(), '\0');
    for (std::size_t begin = 0; begin < text.size(); begin += 8) {
      const auto filled = get<std::uint8_t>();
      for (std::size_t n = 0; n < 8; ++n) {
        if ((filled >> n & 1) != 0) text[begin + n] = get<char>();
      }
    }
    return text;
  }

 private:
  template <typename T>
  T get() {
    T value;
    invariant(bytes_.size() >= sizeof(value), "a packed sector is as long as it was");
    std::memcpy(&value, bytes_.data(), sizeof(value));
    bytes_.remove_prefix(sizeof(value));
    return value;
  }

  std::string_view bytes_;
};

void write_set(const PackWriter& write, const OffsetSet& set) {
  for (const std::uint64_t word : set.near()) write.count(word);
  write.count(set.far().size());
  for (const SectorOffset& offset : set.far()) {
    for (const std::int64_t n : {offset.i, offset.j, offset.k}) write.difference(n);
  }
}

OffsetSet read_set(PackReader& read) {
  OffsetSet::Near near;
  for (std::uint64_t& word : near) word = read.count();
  std::vector<SectorOffset> far(read.count());
  for (SectorOffset& offset : far) {
    for (std::int64_t* n : {&offset.i, &offset.j, &offset.k}) *n = read.difference();
  }
  return {near, std::move(far)};
}

void write_state(const PackWriter& write, const BodyState& state) {
  write.numbers(state.position);
  write.numbers(state.rotation);
  write.numbers(state.linear_velocity);
  write.numbers(state.angular_velocity);
  write.numbers({&state.still_for, 1});
  write.count(static_cast<std::uint64_t>(state.activity));
}

BodyState read_state(PackReader& read) {
  BodyState state;
  read.numbers(state.position);
  read.numbers(state.rotation);
  read.numbers(state.linear_velocity);
  read.numbers(state.angular_velocity);
  read.numbers({&state.still_for, 1});
  state.activity = static_cast<Activity>(read.count());
  return state;
}

using BodyPair = std::pair<BodyId, BodyId>;

void write_pairs(const PackWriter& write, const std::vector<BodyPair>& pairs) {
  write.count(pairs.size());
  for (const auto& [a, b] : pairs) {
    write.count(a.value);
    write.count(b.value);
  }
}

std::vector<BodyPair> read_pairs(PackReader& read) {
  std::vector<BodyPair> pairs(read.count());
  for (auto& [a, b] : pairs) {
    a.value = read.count();
    b.value = read.count();
  }
  return pairs;
}

// The home of a clone, seen from the sector that it is in; any two indices have a difference modulo 2^64.
void write_home(const PackWriter& write, const SectorIndex& home, const SectorIndex& from) {
  const auto minus = [](std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
  };
  write.difference(minus(home.i, from.i));
  write.difference(minus(home.j, from.j));
  write.difference(minus(home.k, from.k));
}

SectorIndex read_home(PackReader& read, const SectorIndex& from) {
  const auto plus = [&](std::int64_t a) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) +
                                     static_cast<std::uint64_t>(read.difference()));
  };
  const std::int64_t i = plus(from.i);
  const std::int64_t j = plus(from.j);
  return {i, j, plus(from.k), from.frame};
}

// All of the properties, so that equal bytes are equal bits.
std::string bytes_of(const BodyProperties& properties) {
  std::string bytes;
  const ByteWriter write(bytes);
  const auto& p = properties;
  write(p.motion);
  write(p.shape);
  write(p.mass);
  write(p.inertia);
  write(p.centre);
  write(p.principal_axes);
  write(p.friction);
  write(p.restitution);
  write(p.linear_damping);
  write(p.angular_damping);
  write(p.category);
  write(p.mask);
  write(p.gravity);
  write(p.assembly);
  write(p.trigger);
  write(p.surface.has_value());
  if (p.surface) write(*p.surface);  // doubles alone
  static_assert(sizeof(Surface) == 13 * sizeof(double));
  write(p.lasting.has_value());
  if (!p.lasting) return bytes;
  write(p.lasting->wrench);  // likewise
  static_assert(sizeof(Wrench) == 6 * sizeof(double));
  write(p.lasting->turns_along);
  return bytes;
}

// A body that lives in the sector: what comes first of each, and all that is wanted of it but by take().
struct PackedHome {
  BodyId id;
  PropertiesPool::Key properties = 0;
  BodyState state;
  OffsetSet replicated_in;
};

PackedHome read_body(PackReader& read, BodyId& last) {
  PackedHome body;
  last.value += read.count();
  body.id = last;
  body.properties = static_cast<PropertiesPool::Key>(read.count());
  body.state = read_state(read);
  body.replicated_in = read_set(read);
  return body;
}

}  // namespace

PropertiesPool::Key PropertiesPool::hold(const BodyProperties& properties) {
  const auto [place, is_new] = keys_.try_emplace(bytes_of(properties));
  if (is_new) {
    if (free_.empty()) {
      free_.push_back(static_cast<Key>(entries_.size()));
      entries_.emplace_back();
    }
    place->second = free_.back();
    free_.pop_back();
    entries_[place->second].properties = properties;
  }
  ++entries_[place->second].holders;
  return place->second;
}

void PropertiesPool::release(const BodyProperties& properties) {
  const auto place = keys_.find(bytes_of(properties));
  invariant(place != keys_.end(), "properties are released that somebody holds");
  if (--entries_[place->second].holders > 0) return;
  free_.push_back(place->second);
  keys_.erase(place);
}

void PackedSectors::add(const MovedSector& sector, const std::vector<BodyPair>& touching, bool has_triggers) {
  std::unique_ptr<Packed>& packed = sectors_[sector.sector];
  invariant(!packed, "a sector is packed once");
  packed = std::make_unique<Packed>();
  packed->index = sector.sector;
  packed->bodies = static_cast<std::uint32_t>(sector.bodies.size());
  packed->reports = reports_;
  packed->has_triggers = has_triggers;
  with_triggers_ += has_triggers ? 1 : 0;

  std::string bytes;
  const PackWriter write(bytes);
  const auto begin_body = [&](BodyId id, BodyId& last, const BodyProperties& properties) {
    holders_[id].push_back(packed.get());
    write.count(id.value - last.value);
    last = id;
    write.count(properties_.hold(properties));
  };
  BodyId last;
  for (const MovedBody& body : sector.bodies) {
    invariant(!body.known_everywhere && !body.next_home && !body.kinematic_target && !body.dirty &&
                  body.joints.empty(),
              "nothing is to be said of a body that is packed");
    begin_body(body.record.id, last, body.record.properties);
    write_state(write, body.record.state);
    write_set(write, body.replicated_in);
  }
  write.count(sector.clones.size());
  last = {};
  for (const MovedClone& clone : sector.clones) {
    const ReplicaUpdate& update = clone.update;
    invariant(update.home == update.next_home, "a clone that is packed stays where it is");
    begin_body(update.id, last, clone.introduction.properties);
    write_home(write, update.home, sector.sector);
    write_state(write, update.state);
    write_set(write, update.replicated_in);
    write.count((clone.placed ? 1 : 0) + (clone.fresh ? 2 : 0) + (update.known_everywhere ? 4 : 0) +
                (update.jointed ? 8 : 0));
  }
  write.count(sector.manifolds.size());
  for (const ManifoldState& manifold : sector.manifolds) {
    write.count(manifold.a.value);
    write.count(manifold.b.value);
    write.text(manifold.points);
  }
  write.numbers(sector.static_region);
  write.count(sector.parts_reported ? 1 : 0);
  write_pairs(write, touching);
  write_pairs(write, sector.touching);
  std::vector<BodyPair> overlaps;
  for (const Overlap& overlap : sector.overlaps) overlaps.emplace_back(overlap.trigger, overlap.visitor);
  write_pairs(write, overlaps);

  packed->bytes.assign(bytes);  // of that length, not of what it grew to
  ++counts_.sectors;
  counts_.worlds += sector.bodies.empty() ? 0 : 1;
  counts_.bodies += sector.bodies.size();
  counts_.bytes += bytes.size();
  note_change(sector.sector);
}

MovedSector PackedSectors::unpacked(const Packed& packed) const {
  PackReader read(packed.bytes);
  MovedSector sector;
  sector.sector = packed.index;
  BodyId last;
  for (std::uint32_t n = 0; n < packed.bodies; ++n) {
    PackedHome body = read_body(read, last);
    MovedBody& home = sector.bodies.emplace_back();
    home.record = {body.id, packed.index, properties_[body.properties], body.state};
    home.replicated_in = std::move(body.replicated_in);
  }
  sector.clones.resize(read.count());
  last = {};
  for (MovedClone& clone : sector.clones) {
    last.value += read.count();
    clone.introduction = {last, properties_[static_cast<PropertiesPool::Key>(read.count())]};
    clone.update.id = last;
    clone.update.home = clone.update.next_home = read_home(read, packed.index);
    clone.update.state = read_state(read);
    clone.update.replicated_in = read_set(read);
    const std::uint64_t flags = read.count();
    clone.placed = (flags & 1) != 0;
    clone.fresh = (flags & 2) != 0;
    clone.update.known_everywhere = (flags & 4) != 0;
    clone.update.jointed = (flags & 8) != 0;
  }
  sector.manifolds.resize(read.count());
  for (ManifoldState& manifold : sector.manifolds) {
    manifold.a.value = read.count();
    manifold.b.value = read.count();
    manifold.points = read.text();
  }
  read.numbers(sector.static_region);
  sector.parts_reported = read.count() != 0;
  std::vector<BodyPair> touches = read_pairs(read);
  std::vector<BodyPair> touching = read_pairs(read);
  for (const auto& [trigger, visitor] : read_pairs(read)) sector.overlaps.push_back({trigger, visitor});
  if (packed.reports == reports_) {
    sector.touching = std::move(touching);
  } else if (reports_contacts_) {
    sector.touching = std::move(touches);
  }
  return sector;
}

MovedSector PackedSectors::copy(const SectorIndex& sector) const { return unpacked(*sectors_.at(sector)); }

MovedSector PackedSectors::take(const SectorIndex& sector) {
  const auto found = sectors_.find(sector);
  invariant(found != sectors_.end(), "a sector that is taken is packed");
  const std::unique_ptr<Packed> packed = std::move(found->second);
  sectors_.erase(found);
  MovedSector moved = unpacked(*packed);
  const auto forget = [&](BodyId id, const BodyProperties& properties) {
    const auto holders = holders_.find(id);
    holders->second.erase(std::find(holders->second.begin(), holders->second.end(), packed.get()));
    if (holders->second.empty()) holders_.erase(holders);
    properties_.release(properties);
  };
  for (const MovedBody& body : moved.bodies) forget(body.record.id, body.record.properties);
  for (const MovedClone& clone : moved.clones) forget(clone.update.id, clone.introduction.properties);
  with_triggers_ -= packed->has_triggers ? 1 : 0;
  --counts_.sectors;
  counts_.worlds -= moved.bodies.empty() ? 0 : 1;
  counts_.bodies -= moved.bodies.size();
  counts_.bytes -= packed->bytes.size();
  note_change(moved.sector);
  return moved;
}

std::vector<SectorIndex> PackedSectors::sectors() const {
  std::vector<SectorIndex> all;
  all.reserve(sectors_.size());
  for (const auto& [index, packed] : sectors_) all.push_back(index);
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<SectorIndex> PackedSectors::with_triggers() const {
  std::vector<SectorIndex> some;
  if (with_triggers_ == 0) return some;
  for (const auto& [index, packed] : sectors_) {
    if (packed->has_triggers) some.push_back(index);
  }
  std::sort(some.begin(), some.end());
  return some;
}

std::vector<SectorIndex> PackedSectors::holding(BodyId id) const {
  std::vector<SectorIndex> found;
  const auto holders = holders_.find(id);
  if (holders == holders_.end()) return found;
  for (const Packed* packed : holders->second) found.push_back(packed->index);
  return found;
}

std::vector<SectorIndex> PackedSectors::touching(BodyId id) const {
  std::vector<SectorIndex> found;
  for (const auto& [index, packed] : sectors_) {
    const MovedSector sector = unpacked(*packed);
    const bool touches = std::any_of(sector.manifolds.begin(), sector.manifolds.end(),
                                     [&](const ManifoldState& pair) { return pair.a == id || pair.b == id; });
    const bool overlaps =
        std::any_of(sector.overlaps.begin(), sector.overlaps.end(),
                    [&](const Overlap& pair) { return pair.trigger == id || pair.visitor == id; });
    if (touches || overlaps) found.push_back(index);
  }
  return found;
}

std::optional<BodyRecord> PackedSectors::body(BodyId id) const {
  for (const SectorIndex& sector : holding(id)) {
    std::optional<BodyRecord> found;
    for_each_body(sector, [&](const BodyRecord& record) {
      if (record.id == id) found = record;
    });
    if (found) return found;
  }
  return std::nullopt;
}

void PackedSectors::for_each(const std::function<void(const SectorIndex&, std::size_t)>& visit) const {
  for (const auto& [index, packed] : sectors_) visit(index, packed->bodies);
}

void PackedSectors::for_each_body(const SectorIndex& sector,
                                  const std::function<void(const BodyRecord&)>& visit) const {
  const Packed& packed = *sectors_.at(sector);
  PackReader read(packed.bytes);
  BodyId last;
  for (std::uint32_t n = 0; n < packed.bodies; ++n) {
    const PackedHome body = read_body(read, last);
    visit({body.id, packed.index, properties_[body.properties], body.state});
  }
}

void PackedSectors::report_contacts(bool on) {
  reports_contacts_ = on;
  ++reports_;
  changed_.reset();
}

void PackedSectors::note_change(const SectorIndex& sector) {
  if (!changed_) return;
  changed_->insert(sector);
  if (changed_->size() > std::max(kChangesKept, counts_.sectors)) changed_.reset();
}

std::optional<std::vector<SectorIndex>> PackedSectors::take_changed() {
  const auto changed = std::exchange(changed_, absl::flat_hash_set<SectorIndex>());
  if (!changed) return std::nullopt;
  return std::vector<SectorIndex>(changed->begin(), changed->end());
}

}  // namespace tessera
