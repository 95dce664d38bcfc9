#include "proto/wire.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "lpss/model/tick_counts.h"
#include "proto/wire_fields.h"

namespace tessera {
namespace {

static_assert(std::endian::native == std::endian::little);

// In the second word of an OffsetSet's near ones: a list of far ones follows.
constexpr std::uint64_t kFarFollow = OffsetSet::kNearMax;

template <typename T>
concept Number = std::same_as<T, std::int64_t> || std::same_as<T, std::uint64_t> ||
    std::same_as<T, std::uint32_t> || std::same_as<T, std::uint8_t> || std::same_as<T, double>;

template <typename T>
concept Enumeration = std::same_as<T, Motion> || std::same_as<T, Activity> || std::same_as<T, JointType> ||
    std::same_as<T, DriveMode>;

constexpr bool is_known(Motion motion) { return motion <= Motion::kKinematic; }
constexpr bool is_known(Activity activity) {
  return activity >= Activity::kAwake && activity <= Activity::kWantsSleep;
}
constexpr bool is_known(JointType type) { return type <= JointType::kScrew; }
constexpr bool is_known(DriveMode mode) { return mode <= DriveMode::kServo; }

// Breaks values down into raw bytes for a `Sink` with bytes(const void*, size); used by Meter and Writer.
template <typename Sink>
class Output {
 public:
  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }

  template <typename T>
  void list(std::span<const T> items) {
    put(static_cast<std::uint64_t>(items.size()));
    for (const T& item : items) put(item);
  }

 private:
  void raw(const void* data, std::size_t size) { static_cast<Sink*>(this)->bytes(data, size); }

  void put(Number auto value) { raw(&value, sizeof value); }
  void put(Enumeration auto value) { put(static_cast<std::uint8_t>(value)); }
  void put(bool value) { put(static_cast<std::uint8_t>(value)); }
  void put(const OffsetSet& set) {
    OffsetSet::Near near = set.near();
    if (!set.far().empty()) near[1] |= kFarFollow;
    raw(near.data(), sizeof near);
    if (!set.far().empty()) list(set.far());
  }
  template <std::size_t N>
  void put(const std::array<double, N>& numbers) {
    raw(numbers.data(), sizeof numbers);
  }
  // Most bodies have none.
  void put(const BodyJoints& joints) {
    put(!joints.empty());
    if (joints.empty()) return;
    put(joints.as_child);
    put(joints.as_parent);
  }
  void put(const std::string& text) {
    put(static_cast<std::uint64_t>(text.size()));
    raw(text.data(), text.size());
  }
  template <typename T>
  void put(const std::vector<T>& items) {
    list(std::span<const T>(items));
  }
  template <typename T>
  void put(const std::optional<T>& item) {
    put(item.has_value());
    if (item) put(*item);
  }
  template <typename T, typename U>
  void put(const std::pair<T, U>& items) {
    put(items.first);
    put(items.second);
  }
  template <typename T>
  void put(const std::shared_ptr<const T>& item) {
    put(*item);
  }
  template <typename... Alternatives>
  void put(const std::variant<Alternatives...>& choice) {
    put(static_cast<std::uint8_t>(choice.index()));
    std::visit([this](const auto& alternative) { put(alternative); }, choice);
  }
  template <typename T>
  requires requires(Sink& sink, const T& x) { describe(sink, x); }
  void put(const T& x) { describe(static_cast<Sink&>(*this), x); }
};

class Meter : public Output<Meter> {
 public:
  void bytes(const void*, std::size_t size) { size_ += size; }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_ = 0;
};

// Writes into memory that a Meter has found to be large enough.
class Writer : public Output<Writer> {
 public:
  explicit Writer(char* to) : to_(to) {}

  void bytes(const void* data, std::size_t size) {
    if (size != 0) std::memcpy(to_, data, size);
    to_ += size;
  }

 private:
  char* to_;
};

// Reads until the first value that does not fit; from then on every value is a default.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <typename... Fields>
  void operator()(Fields&... fields) {
    (get(fields), ...);
  }

  template <typename T>
  void list(std::vector<T>& items) {
    std::uint64_t count = 0;
    get(count);
    // Every item takes at least one byte, so a larger count is invalid. Memory is allocated as items are
    // read.
    if (count > rest_.size()) return fail();
    items.reserve(std::min<std::size_t>(count, rest_.size() / sizeof(T) + 1));
    for (std::uint64_t n = 0; n < count && ok_; ++n) get(items.emplace_back());
  }

  // Whether all bytes were consumed.
  absl::Status done(const char* what) const {
    if (ok_ && rest_.empty()) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat(what, ok_ ? ": bytes are left over" : ": the bytes do not fit"));
  }

 private:
  void fail() {
    ok_ = false;
    rest_ = {};
  }

  void raw(void* to, std::size_t size) {
    if (size > rest_.size()) return fail();
    std::memcpy(to, rest_.data(), size);
    rest_.remove_prefix(size);
  }

  void get(Number auto& value) { raw(&value, sizeof value); }
  template <Enumeration T>
  void get(T& value) {
    std::uint8_t number = 0;
    get(number);
    if (!ok_) return;
    if (!is_known(static_cast<T>(number))) return fail();
    value = static_cast<T>(number);
  }
  void get(bool& value) {
    std::uint8_t number = 0;
    get(number);
    if (number > 1) return fail();
    value = number == 1;
  }
  void get(OffsetSet& set) {
    OffsetSet::Near near{};
    raw(near.data(), sizeof near);
    std::vector<SectorOffset> far;
    if ((near[1] & kFarFollow) != 0) list(far);
    near[1] &= ~kFarFollow;
    if (near[1] >= OffsetSet::kNearMax || !OffsetSet::are_far(far)) return fail();
    set = OffsetSet(near, std::move(far));
  }
  template <std::size_t N>
  void get(std::array<double, N>& numbers) {
    raw(numbers.data(), sizeof numbers);
  }
  void get(BodyJoints& joints) {
    bool are_there = false;
    get(are_there);
    if (!are_there) return;
    get(joints.as_child);
    get(joints.as_parent);
    if (joints.empty()) fail();
  }
  void get(std::string& text) {
    std::uint64_t size = 0;
    get(size);
    if (size > rest_.size()) return fail();
    text.assign(rest_.substr(0, size));
    rest_.remove_prefix(size);
  }
  template <typename T>
  void get(std::vector<T>& items) {
    list(items);
  }
  template <typename T>
  void get(std::optional<T>& item) {
    bool is_there = false;
    get(is_there);
    if (ok_ && is_there) get(item.emplace());
  }
  template <typename T, typename U>
  void get(std::pair<T, U>& items) {
    get(items.first);
    get(items.second);
  }
  template <typename T>
  void get(std::shared_ptr<const T>& item) {
    auto read = std::make_shared<T>();
    get(*read);
    item = std::move(read);
  }
  template <std::size_t Index = 0, typename... Alternatives>
  void alternative(std::uint8_t index, std::variant<Alternatives...>& choice) {
    if constexpr (Index == sizeof...(Alternatives)) {
      fail();
    } else if (index == Index) {
      get(choice.template emplace<Index>());
    } else {
      alternative<Index + 1>(index, choice);
    }
  }
  template <typename... Alternatives>
  void get(std::variant<Alternatives...>& choice) {
    std::uint8_t index = 0;
    get(index);
    if (ok_) alternative(index, choice);
  }
  template <typename T>
  requires requires(Reader& reader, T& x) { describe(reader, x); }
  void get(T& x) { describe(*this, x); }

  std::string_view rest_;
  bool ok_ = true;
};

template <typename Write>
std::string packed(const Write& write) {
  Meter meter;
  write(meter);
  std::string bytes(meter.size(), '\0');
  Writer writer(bytes.data());
  write(writer);
  return bytes;
}

template <typename T>
std::string pack_struct(const T& value) {
  return packed([&](auto& archive) { archive(value); });
}

template <typename T>
std::string pack_list(std::span<const T> items) {
  return packed([&](auto& archive) { archive.list(items); });
}

template <typename T>
absl::StatusOr<T> unpack_struct(std::string_view bytes, const char* what) {
  Reader reader(bytes);
  T value;
  reader(value);
  if (absl::Status status = reader.done(what); !status.ok()) return status;
  return value;
}

template <typename T>
std::size_t packed_size() {
  Meter meter;
  meter(T{});
  return meter.size();
}

}  // namespace

std::uint64_t wire_layout() {
  constexpr std::uint64_t kPrime = 0x100000001b3;  // FNV-1a
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const std::size_t number : {std::size_t{kClusterProtocol},    sizeof(BodyRecord),
                                   packed_size<BodyRecord>(),        packed_size<Surface>(),
                                   packed_size<ReplicaUpdate>(),     packed_size<Handover>(),
                                   packed_size<ManifoldTransfer>(),  packed_size<Exchange>(),
                                   packed_size<IslandPart>(),        packed_size<SectorSeams>(),
                                   packed_size<ShippedBody>(),       packed_size<ShippedPair>(),
                                   packed_size<ShippedIsland>(),     packed_size<SolvedIsland>(),
                                   packed_size<Solution>(),          packed_size<ApplyImpulse>(),
                                   packed_size<ApplyForce>(),        packed_size<Teleport>(),
                                   packed_size<KinematicTarget>(),   packed_size<JointRecord>(),
                                   packed_size<SetDrives>(),         packed_size<JointTie>(),
                                   packed_size<JointAxis>(),         packed_size<HeldJoint>(),
                                   packed_size<AddJoint>(),          packed_size<SetSurfaceMotion>(),
                                   packed_size<SetProperties>(),     packed_size<ApplyRadialImpulse>(),
                                   packed_size<MovedBody>(),         packed_size<MovedClone>(),
                                   packed_size<MovedSector>(),       packed_size<Shipment>(),
                                   packed_size<SharedState>(),       packed_size<KnownReplica>(),
                                   packed_size<Agreement>(),         std::variant_size_v<Command>,
                                   std::variant_size_v<RoundMessage>}) {
    hash = (hash ^ number) * kPrime;
  }
  for (const TickCounter& counter : kTickCounters) {
    for (const char letter : std::string_view(counter.name))
      hash = (hash ^ static_cast<unsigned char>(letter)) * kPrime;
    hash *= kPrime;
  }
  return hash;
}

std::string pack(std::span<const BodyRecord> records) { return pack_list(records); }
std::string pack(std::span<const JointRecord> joints) { return pack_list(joints); }
std::string pack(std::span<const Command> commands) { return pack_list(commands); }
std::string pack(const RoundMessage& message) { return pack_struct(message); }
std::string pack(const SharedState& state) { return pack_struct(state); }
std::string pack(std::span<const MovedSector> sectors) { return pack_list(sectors); }
std::size_t packed_bytes(const MovedSector& sector) {
  Meter meter;
  meter(sector);
  return meter.size();
}

absl::StatusOr<std::vector<BodyRecord>> unpack_records(std::string_view bytes) {
  return unpack_struct<std::vector<BodyRecord>>(bytes, "body records");
}
absl::StatusOr<std::vector<JointRecord>> unpack_joints(std::string_view bytes) {
  return unpack_struct<std::vector<JointRecord>>(bytes, "joints");
}
absl::StatusOr<std::vector<Command>> unpack_commands(std::string_view bytes) {
  return unpack_struct<std::vector<Command>>(bytes, "commands");
}
absl::StatusOr<RoundMessage> unpack_round(std::string_view bytes) {
  return unpack_struct<RoundMessage>(bytes, "round of a tick");
}
absl::StatusOr<SharedState> unpack_shared(std::string_view bytes) {
  return unpack_struct<SharedState>(bytes, "shared state");
}
absl::StatusOr<std::vector<MovedSector>> unpack_sectors(std::string_view bytes) {
  return unpack_struct<std::vector<MovedSector>>(bytes, "sectors");
}

}  // namespace tessera
