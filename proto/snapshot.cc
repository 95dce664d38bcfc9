#include "proto/snapshot.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "lpss/base/arithmetic_fingerprint.h"
#include "proto/convert.h"
#include "proto/kept_chunks.h"
#include "proto/wire.h"

namespace tessera {
namespace {

using Chunk = v1::SnapshotChunk;

// What a command adds or removes leaves all chunks as they were but the one of these ids.
constexpr std::uint64_t kIdsPerChunk = 1024;

// Spreads items over chunks, whose keys count up: `add` puts one into a chunk, and returns its size in bytes.
template <typename Items, typename Add>
void spread(Chunk::KindCase kind, const Items& items, std::vector<Chunk>& chunks, const Add& add) {
  std::size_t room = 0;
  std::uint64_t number = 0;
  for (const auto& item : items) {
    if (room == 0) {
      chunks.emplace_back().set_key(chunk_key(kind, number++));
      room = kSnapshotChunkBytes;
    }
    room -= std::min(room, add(item, chunks.back()));
  }
}

// Those of some ids in a chunk: `add` gets all items of one, which ascend by their ids, and the chunk.
template <typename Items, typename IdOf, typename Add>
void spread_by_ids(Chunk::KindCase kind, const Items& items, std::vector<Chunk>& chunks, const IdOf& id_of,
                   const Add& add) {
  for (auto begin = items.begin(); begin != items.end();) {
    const std::uint64_t number = id_of(*begin).value / kIdsPerChunk;
    const auto end = std::find_if(
        begin, items.end(), [&](const auto& item) { return id_of(item).value / kIdsPerChunk != number; });
    Chunk& chunk = chunks.emplace_back();
    chunk.set_key(chunk_key(kind, number));
    add(std::span(begin, end), chunk);
    begin = end;
  }
}

absl::Status lost(const std::string& what) { return absl::DataLossError(absl::StrCat("snapshot: ", what)); }

// Takes the chunks in their order.
class ChunkReader {
 public:
  absl::Status take(const Chunk& chunk) {
    const int kind = chunk.kind_case();
    if (kind == Chunk::KIND_NOT_SET) return lost("a chunk has no contents, or is of a newer version");
    if (ended_) return lost("chunks follow the end");
    const bool repeats = kind != Chunk::kHead && kind != Chunk::kShared && kind != Chunk::kEnd;
    if (kind < last_ || (kind == last_ && !repeats) || (last_ == 0 && kind != Chunk::kHead)) {
      return lost(absl::StrCat("chunk ", chunks_, " is of kind ", kind, ", after one of kind ", last_));
    }
    last_ = kind;
    absl::Status status = read(chunk);
    ++chunks_;
    return status;
  }

  absl::StatusOr<ReadSnapshot> finish() {
    if (!ended_) return lost("its end is missing");
    if (absl::Status status = take_held_shapes(); !status.ok()) return status;
    std::sort(read_.world.sectors.begin(), read_.world.sectors.end(),
              [](const MovedSector& a, const MovedSector& b) { return a.sector < b.sector; });
    if (absl::Status status = validate(read_.world); !status.ok()) return status;
    if (absl::Status status = validate(read_.catalogue, read_.world); !status.ok()) return status;
    return std::move(read_);
  }

 private:
  absl::Status read(const Chunk& chunk) {
    switch (chunk.kind_case()) {
      case Chunk::kHead:
        return read_head(chunk.head());
      case Chunk::kShapes:
        return read_shapes(chunk.shapes());
      case Chunk::kBodies:
        return read_bodies(chunk.bodies());
      case Chunk::kJoints:
        return read_joints(chunk.joints());
      case Chunk::kFrames:
        return read_frames(chunk.frames());
      case Chunk::kHeld:
        return read_held(chunk.held());
      case Chunk::kShared:
        return assign(unpack_shared(chunk.shared(), version_), read_.world.shared);
      case Chunk::kSectors:
        return read_sectors(chunk.sectors());
      case Chunk::kEnd:
        ended_ = true;
        if (chunk.end().chunks() == chunks_ && has_shared_) return absl::OkStatus();
        return lost(absl::StrCat("it has ", chunks_, " chunks, and says ", chunk.end().chunks()));
      case Chunk::kParts:
        return lost("it has only what has changed since other files");
      case Chunk::kWorld:
        return lost("it is a world as it was loaded");
      case Chunk::KIND_NOT_SET:
        break;
    }
    return absl::OkStatus();
  }

  absl::Status assign(absl::StatusOr<SharedState> from, SharedState& to) {
    if (!from.ok()) return from.status();
    to = *std::move(from);
    has_shared_ = true;
    return absl::OkStatus();
  }

  absl::Status read_head(const v1::SnapshotHead& head) {
    if (head.version() < kStoredVersionMin || head.version() > kStoredVersion) {
      return absl::FailedPreconditionError(
          absl::StrCat("the snapshot was written by another version of Tessera: its format is ",
                       head.version(), ", and this one reads ", kStoredVersionMin, " to ", kStoredVersion));
    }
    if (head.version() == kStoredVersion && head.layout() != stored_layout()) {
      return absl::FailedPreconditionError(absl::StrCat(
          "the snapshot was written by a build between two versions of Tessera: its format is an unfinished ",
          kStoredVersion));
    }
    version_ = head.version();
    if (head.arithmetic() != arithmetic_fingerprint()) {
      return absl::FailedPreconditionError(
          "the snapshot was written by a build that computes other bits than this one");
    }
    absl::StatusOr<WorldSettings> settings = from_proto(head.settings());
    if (!settings.ok()) return settings.status();
    if (!head.has_anchor()) return lost("the anchor is missing");
    read_.world.settings = *settings;
    read_.world.anchor = from_proto(head.anchor());
    read_.world.tick = head.tick();
    read_.catalogue.name = head.name();
    read_.catalogue.next_body = BodyId{head.next_body()};
    read_.catalogue.next_joint = JointId{head.next_joint()};
    read_.catalogue.next_shape = head.next_shape();
    return absl::OkStatus();
  }

  absl::Status read_shapes(const v1::SnapshotShapes& shapes) {
    if (shapes.ids_size() != shapes.shapes_size()) {
      return lost(absl::StrCat(shapes.shapes_size(), " shapes have ", shapes.ids_size(), " ids"));
    }
    for (int n = 0; n < shapes.shapes_size(); ++n) {
      absl::StatusOr<Shape> shape = from_proto(shapes.shapes(n));
      if (!shape.ok()) return shape.status();
      read_.world.shapes.push_back({shapes.ids(n), std::make_shared<const Shape>(*std::move(shape))});
    }
    return absl::OkStatus();
  }

  absl::Status read_bodies(const v1::SnapshotBodies& bodies) {
    for (const v1::SnapshotBodies::Body& body : bodies.bodies()) {
      absl::StatusOr<BodyProperties> properties = from_proto(body.properties());
      if (!properties.ok()) return properties.status();
      BodyTags tags{body.owner(), body.user_data(), {body.programs().begin(), body.programs().end()}};
      read_.catalogue.bodies.push_back({BodyId{body.id()}, body.name(), *properties, std::move(tags)});
    }
    return absl::OkStatus();
  }

  absl::Status read_joints(const v1::SnapshotJoints& joints) {
    absl::StatusOr<std::vector<JointRecord>> records = unpack_joints(joints.records(), version_);
    if (!records.ok()) return records.status();
    if (records->size() != static_cast<std::size_t>(joints.names_size())) {
      return lost(absl::StrCat(records->size(), " joints have ", joints.names_size(), " names"));
    }
    for (int n = 0; n < joints.names_size(); ++n) {
      read_.catalogue.joints.push_back({joints.names(n), (*records)[static_cast<std::size_t>(n)]});
    }
    return absl::OkStatus();
  }

  absl::Status read_frames(const v1::SnapshotFrames& frames) {
    for (const v1::SnapshotFrames::Frame& frame : frames.frames()) {
      if (!frame.has_pose()) return lost(absl::StrCat("frame '", frame.name(), "' has no pose"));
      read_.catalogue.frames.push_back({frame.name(), BodyId{frame.body()}, from_proto(frame.pose())});
    }
    return absl::OkStatus();
  }

  absl::Status read_held(const v1::SnapshotHeldBatch& held) {
    absl::StatusOr<std::vector<Command>> commands = unpack_commands(held.commands(), version_);
    if (!commands.ok()) return commands.status();
    read_.catalogue.held.push_back({*std::move(commands), {}});
    held_shapes_.push_back(held.new_shapes());
    return absl::OkStatus();
  }

  absl::Status read_sectors(const std::string& bytes) {
    absl::StatusOr<std::vector<MovedSector>> sectors = unpack_sectors(bytes, version_);
    if (!sectors.ok()) return sectors.status();
    std::move(sectors->begin(), sectors->end(), std::back_inserter(read_.world.sectors));
    return absl::OkStatus();
  }

  // The last shapes are those of held commands.
  absl::Status take_held_shapes() {
    std::vector<ShapeEntry>& shapes = read_.world.shapes;
    std::uint64_t count = 0;
    for (const std::uint32_t held : held_shapes_) count += held;
    if (count > shapes.size()) return lost("held commands have more shapes than there are");
    auto next = shapes.end() - static_cast<std::ptrdiff_t>(count);
    for (std::size_t n = 0; n < held_shapes_.size(); ++n) {
      const auto end = next + held_shapes_[n];
      std::move(next, end, std::back_inserter(read_.catalogue.held[n].new_shapes));
      next = end;
    }
    shapes.resize(shapes.size() - count);
    return absl::OkStatus();
  }

  ReadSnapshot read_;
  std::uint32_t version_ = kStoredVersion;  // of the head
  std::vector<std::uint32_t> held_shapes_;  // by batch
  int last_ = 0;                            // kind
  std::uint64_t chunks_ = 0;
  bool has_shared_ = false;
  bool ended_ = false;
};

}  // namespace

Chunk head_chunk(const WorldCatalogue& catalogue, const WorldSettings& settings, const SectorIndex& anchor,
                 Tick tick) {
  Chunk chunk;
  chunk.set_key(chunk_key(Chunk::kHead));
  v1::SnapshotHead& head = *chunk.mutable_head();
  head.set_version(kStoredVersion);
  head.set_layout(stored_layout());
  head.set_arithmetic(arithmetic_fingerprint());
  head.set_name(catalogue.name);
  *head.mutable_settings() = to_proto(settings);
  *head.mutable_anchor() = to_proto(anchor);
  head.set_tick(tick);
  head.set_next_body(catalogue.next_body.value);
  head.set_next_joint(catalogue.next_joint.value);
  head.set_next_shape(catalogue.next_shape);
  return chunk;
}

std::vector<Chunk> held_chunks(const WorldCatalogue& catalogue) {
  std::vector<Chunk> chunks;
  for (const WorldCatalogue::HeldBatch& batch : catalogue.held) {
    const std::uint64_t number = chunks.size();
    Chunk& chunk = chunks.emplace_back();
    chunk.set_key(chunk_key(Chunk::kHeld, number));
    chunk.mutable_held()->set_commands(pack(std::span<const Command>(batch.commands)));
    chunk.mutable_held()->set_new_shapes(static_cast<std::uint32_t>(batch.new_shapes.size()));
  }
  return chunks;
}

std::vector<ShapeEntry> with_held_shapes(const WorldCatalogue& catalogue,
                                         std::span<const ShapeEntry> shapes) {
  std::vector<ShapeEntry> all(shapes.begin(), shapes.end());
  for (const WorldCatalogue::HeldBatch& batch : catalogue.held)
    all.insert(all.end(), batch.new_shapes.begin(), batch.new_shapes.end());
  return all;
}

std::vector<Chunk> catalogue_chunks(const WorldCatalogue& catalogue, std::span<const ShapeEntry> shapes) {
  std::vector<Chunk> chunks;
  spread(Chunk::kShapes, shapes, chunks, [](const ShapeEntry& entry, Chunk& chunk) {
    chunk.mutable_shapes()->add_ids(entry.id);
    v1::Shape& to = *chunk.mutable_shapes()->add_shapes();
    to = to_proto(*entry.shape);
    return to.ByteSizeLong();
  });
  spread_by_ids(
      Chunk::kBodies, catalogue.bodies, chunks, [](const WorldCatalogue::Body& body) { return body.id; },
      [](std::span<const WorldCatalogue::Body> bodies, Chunk& chunk) {
        for (const WorldCatalogue::Body& body : bodies) {
          v1::SnapshotBodies::Body& to = *chunk.mutable_bodies()->add_bodies();
          to.set_id(body.id.value);
          to.set_name(body.name);
          to.set_owner(body.tags.owner);
          to.set_user_data(body.tags.user_data);
          to.mutable_programs()->Add(body.tags.programs.begin(), body.tags.programs.end());
          *to.mutable_properties() = to_proto(body.properties);
        }
      });
  spread_by_ids(
      Chunk::kJoints, catalogue.joints, chunks,
      [](const WorldCatalogue::Joint& joint) { return joint.record.id; },
      [](std::span<const WorldCatalogue::Joint> joints, Chunk& chunk) {
        std::vector<JointRecord> records;
        for (const WorldCatalogue::Joint& joint : joints) {
          chunk.mutable_joints()->add_names(joint.name);
          records.push_back(joint.record);
        }
        chunk.mutable_joints()->set_records(pack(std::span<const JointRecord>(records)));
      });
  spread(Chunk::kFrames, catalogue.frames, chunks, [](const WorldCatalogue::Frame& frame, Chunk& chunk) {
    v1::SnapshotFrames::Frame& to = *chunk.mutable_frames()->add_frames();
    to.set_name(frame.name);
    to.set_body(frame.body.value);
    *to.mutable_pose() = to_proto(frame.pose);
    return to.ByteSizeLong();
  });
  return chunks;
}

std::vector<Chunk> head_chunks(const WorldCatalogue& catalogue, const WorldSettings& settings,
                               const SectorIndex& anchor, Tick tick, std::span<const ShapeEntry> shapes) {
  std::vector<Chunk> chunks{head_chunk(catalogue, settings, anchor, tick)};
  for (Chunk& chunk : catalogue_chunks(catalogue, with_held_shapes(catalogue, shapes)))
    chunks.push_back(std::move(chunk));
  for (Chunk& chunk : held_chunks(catalogue)) chunks.push_back(std::move(chunk));
  for (Chunk& chunk : chunks) chunk.clear_key();
  return chunks;
}

Chunk shared_chunk(const SharedState& state) {
  Chunk chunk;
  chunk.set_shared(pack(state));
  return chunk;
}

void SectorChunks::add(MovedSector sector) {
  bytes_ += packed_bytes(sector);
  sectors_.push_back(std::move(sector));
  if (bytes_ >= kSnapshotChunkBytes) end_chunk();
}

void SectorChunks::end_chunk() {
  if (sectors_.empty()) return;
  chunks_.emplace_back().set_sectors(pack(std::span<const MovedSector>(sectors_)));
  sectors_.clear();
  bytes_ = 0;
}

std::vector<Chunk> SectorChunks::finish() {
  end_chunk();
  return std::exchange(chunks_, {});
}

Chunk end_chunk(std::size_t chunks_before) {
  Chunk chunk;
  chunk.mutable_end()->set_chunks(chunks_before);
  return chunk;
}

std::vector<Chunk> chunks_of(const WorldSnapshot& world, const WorldCatalogue& catalogue) {
  std::vector<Chunk> chunks = head_chunks(catalogue, world.settings, world.anchor, world.tick, world.shapes);
  chunks.push_back(shared_chunk(world.shared));
  SectorChunks sectors;
  for (const MovedSector& sector : world.sectors) sectors.add(sector);
  for (Chunk& chunk : sectors.finish()) chunks.push_back(std::move(chunk));
  chunks.push_back(end_chunk(chunks.size()));
  return chunks;
}

absl::StatusOr<ReadSnapshot> from_chunks(std::span<const Chunk> chunks) {
  ChunkReader reader;
  for (const Chunk& chunk : chunks) {
    if (absl::Status status = reader.take(chunk); !status.ok()) return status;
  }
  return reader.finish();
}

}  // namespace tessera
