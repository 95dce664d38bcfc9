// Snapshots: what is read as one is a world that goes on, with the commands that it holds. Inputs are chunks
// in protobuf's text format, or the bytes of a file.
#include "proto/snapshot.h"

#include "inputs.pb.h"
#include "lpss/base/arithmetic_fingerprint.h"
#include "lpss/base/invariant.h"
#include "lpss/simulation/simulation.h"
#include "proto/snapshot_file.h"
#include "proto/wire.h"
#include "tests/fuzz/input.h"

namespace tessera {
namespace {

constexpr int kTicks = 3;
constexpr std::size_t kBodiesHere = 200;  // larger worlds only take time

void read_file(std::string_view bytes) {
  SnapshotDecoder decoder;
  const std::size_t half = bytes.size() / 2;
  if (decoder.add(bytes.substr(0, half)).ok() && decoder.add(bytes.substr(half)).ok())
    static_cast<void>(decoder.finish());
}

// Of this version, however it was written: inputs outlive it.
void go_on(fuzz::SnapshotChunks given) {
  for (v1::SnapshotChunk& chunk : *given.mutable_all()) {
    if (!chunk.has_head()) continue;
    chunk.mutable_head()->set_version(kStoredVersion);
    chunk.mutable_head()->set_layout(stored_layout());
    chunk.mutable_head()->set_arithmetic(arithmetic_fingerprint());
  }
  const std::vector<v1::SnapshotChunk> chunks(given.all().begin(), given.all().end());
  absl::StatusOr<ReadSnapshot> read = from_chunks(chunks);
  if (!read.ok()) return;
  invariant(from_chunks(chunks_of(read->world, read->catalogue)).ok(),
            "a snapshot can be read as it is written");
  std::size_t bodies = read->world.shared.statics.size();
  for (const MovedSector& sector : read->world.sectors) bodies += sector.bodies.size() + sector.clones.size();
  if (bodies > kBodiesHere) return;
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::restore(read->world, 1);
  if (!simulation.ok()) return;
  for (int n = 0; n < kTicks; ++n) (*simulation)->step();
}

}  // namespace
}  // namespace tessera

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  const std::string_view bytes = fuzz::text_of(data, size);
  fuzz::SnapshotChunks chunks;
  if (fuzz::read_text(bytes, chunks)) {
    go_on(std::move(chunks));
  } else {
    read_file(bytes);
  }
  return 0;
}
