#include "lpss/observe/world_hash.h"

#include <absl/strings/str_format.h>
#include <xxhash.h>

#include <cstring>

namespace tessera {
namespace {

// Everything that counts, without padding.
struct Hashed {
  std::uint64_t id;
  std::uint64_t home[3];
  double position[3];
  double rotation[9];
  double linear_velocity[3];
  double angular_velocity[3];
};
static_assert(sizeof(Hashed) == 22 * 8);

}  // namespace

void WorldHash::add(const BodyRecord& record, const SectorIndex& anchor_of_world) {
  const SectorIndex anchor = anchor_for(record.home, anchor_of_world);
  const auto relative = [](std::int64_t value, std::int64_t origin) {
    return static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(origin);
  };
  Hashed hashed{record.id.value,
                {relative(record.home.i, anchor.i), relative(record.home.j, anchor.j),
                 relative(record.home.k, anchor.k)},
                {},
                {},
                {},
                {}};
  std::memcpy(hashed.position, record.state.position.data(), sizeof hashed.position);
  std::memcpy(hashed.rotation, record.state.rotation.data(), sizeof hashed.rotation);
  std::memcpy(hashed.linear_velocity, record.state.linear_velocity.data(), sizeof hashed.linear_velocity);
  std::memcpy(hashed.angular_velocity, record.state.angular_velocity.data(), sizeof hashed.angular_velocity);
  const XXH128_hash_t hash = XXH3_128bits_withSeed(&hashed, sizeof hashed, record.home.frame);
  add(WorldHash(hash.low64, hash.high64));
}

void WorldHash::add_programs(BodyId body, const std::vector<ProgramRecord>& programs) {
  std::string bytes;
  const auto append = [&](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  const auto append_numbers = [&](const std::vector<double>& numbers) {
    append(numbers.data(), numbers.size() * sizeof(double));
  };
  for (std::size_t place = 0; place < programs.size(); ++place) {
    const ProgramRecord& program = programs[place];
    bytes.assign(program.kind);
    append(&body.value, sizeof body.value);
    append(&place, sizeof place);
    append_numbers(program.parameters);
    append_numbers(program.inputs);
    append_numbers(program.values);
    append(&program.wake_at, sizeof program.wake_at);
    bytes += program.fault;
    const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
    add(WorldHash(hash.low64, hash.high64));
  }
}

void WorldHash::add(const WorldHash& other) {
  low_ += other.low_;
  high_ += other.high_;
}

std::string WorldHash::to_string() const { return absl::StrFormat("%016x%016x", high_, low_); }

}  // namespace tessera
