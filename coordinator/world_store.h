// What a coordinator must find again when it is started anew: its world, and what has happened to it since.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "proto/kept_chunks.h"
#include "snapshot.pb.h"
#include "store.pb.h"
#include "world.pb.h"

namespace tessera {

// A world as clients load it, or all chunks of a snapshot.
using StoredState = std::variant<v1::World, std::vector<v1::SnapshotChunk>>;

struct StoredWorld {
  std::uint64_t load = 0;  // the number of the load, which clients know
  StoredState state;
  std::vector<v1::StoredInput> inputs;  // since then
  std::vector<std::string> repaired;    // damage that was made good when this was read: one line each
};

// What leads from the state that is stored to a later one.
struct StateChange {
  bool is_whole = false;  // these are all chunks of the later one
  KeptChunks chunks;
};

// One thread uses it. Errors are the system's, with the file. Then what was stored before is there unchanged,
// and the call may be repeated.
class WorldStore {
 public:
  virtual ~WorldStore() = default;

  // What was there when it was opened; once.
  virtual std::optional<StoredWorld> take_stored() = 0;

  // What is there now. UNIMPLEMENTED for a store that cannot tell; what a restart would find, otherwise.
  virtual absl::StatusOr<StoredWorld> read_again() {
    return absl::UnimplementedError("this store is read by the coordinator that begins with it");
  }

  // A world begins, in the place of another. On return it is on disk.
  virtual absl::Status begin(std::uint64_t load, const StoredState& state) = 0;
  // There is no world any more.
  virtual absl::Status end() = 0;
  // Likewise, and what is stored of it is kept where the store that is opened next does not look, with the
  // reason; returns where, which is a store of its own, or nothing where that cannot be.
  virtual absl::StatusOr<std::string> set_aside(const std::string& /*reason*/) {
    absl::Status status = end();
    if (!status.ok()) return status;
    return std::string();
  }

  // They are stored once stored() has passed them; where that takes a while, tend() goes on with it.
  virtual absl::Status append(const std::vector<v1::StoredInput>& inputs) = 0;
  // The number of inputs so far.
  virtual std::uint64_t position() const = 0;
  // So many of them are where they outlive this process.
  virtual std::uint64_t stored() const { return position(); }

  // Whether the next change must be a whole state: what is stored is of another kind, or one got lost.
  virtual bool wants_whole() const = 0;
  // The world after the inputs up to `position`: takes the place of what is stored, in the background. False,
  // and nothing happens, while another one is being written.
  virtual bool change(StateChange change, std::uint64_t position) = 0;
  // Call it now and then: the errors of the background, after which another one may be written.
  virtual absl::Status tend() = 0;
};

}  // namespace tessera
