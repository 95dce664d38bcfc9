// `tessera run --trajectory`: where bodies are and how they move, tick by tick, as a table for programs.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/settings.h"
#include "tessera/stream.h"

namespace tessera::cli {

inline constexpr std::uint32_t kTrajectoryEveryMax = 1'000'000'000;  // ticks

struct TrajectoryOptions {
  std::filesystem::path file;  // empty: none
  std::vector<std::string>
      bodies;               // globs of names, as fnmatch(3) reads them; empty: all that are not static
  std::uint32_t every = 1;  // only ticks that are multiples of this, and the first
};

// "GLOB,GLOB,...". INVALID_ARGUMENT where one is empty.
absl::StatusOr<std::vector<std::string>> parse_globs(const std::string& text);

// A file in CSV with a row for each chosen body and tick. Poses are those of body frames, in metres from the
// centre of the sector that is named; velocities are those of centres of mass, along the world's axes. All
// numbers are read back alike. Rows are ascending by (tick, id of the body); ids follow the order of the
// world file. A body has no rows before it is spawned and after it is removed. Not for several threads at a
// time.
class Trajectory {
 public:
  // A body that the world has, or is going to have.
  struct Candidate {
    BodyId id;
    std::string name;
    bool is_static = false;
  };

  // Chooses among `bodies`, ascending by id, and makes the file with its header. `first` is the tick that the
  // world is at. INVALID_ARGUMENT, naming the glob, where no body has such a name; UNAVAILABLE, naming the
  // file.
  static absl::StatusOr<std::unique_ptr<Trajectory>> open(const TrajectoryOptions& options,
                                                          std::span<const Candidate> bodies,
                                                          const WorldSettings& settings, Tick first);

  // The chosen bodies, ascending.
  const std::vector<BodyId>& ids() const { return ids_; }
  std::uint32_t every() const { return every_; }
  bool wants(Tick tick) const { return tick == first_ || tick % every_ == 0; }

  // A row, where the body is one of them. Ascending by (tick, body).
  void add(Tick tick, const BodySample& body);
  // Likewise of a body as it is simulated.
  void add(Tick tick, const BodyRecord& body);

  // UNAVAILABLE, naming the file, where any of it could not be written.
  absl::Status finish();

 private:
  Trajectory() = default;
  void flush();

  std::filesystem::path file_;
  std::ofstream out_;
  std::string text_;  // rows to be written
  std::vector<BodyId> ids_;
  std::vector<std::string> names_;  // of those, as cells
  Tick first_ = 0;
  std::uint32_t every_ = 1;
  double time_step_ = 0;
  double sector_size_ = 0;
  std::vector<std::string> frames_;  // that move, likewise; the column is there if there are any
};

}  // namespace tessera::cli
