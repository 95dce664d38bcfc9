#include "sector_server/world_loading.h"

#include <absl/strings/str_cat.h>

#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/observe/state.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/programs/module.h"
#include "lpss/snapshot/record_checks.h"
#include "lpss/snapshot/world_snapshot.h"
#include "proto/convert.h"
#include "proto/wire.h"

namespace tessera {
namespace {

absl::StatusOr<SectorMap> read_map(const SectorIndex& anchor,
                                   const google::protobuf::RepeatedPtrField<v1::SectorIndex>& messages,
                                   const google::protobuf::RepeatedField<std::uint32_t>& owners,
                                   std::size_t servers, std::uint64_t epoch) {
  std::vector<SectorIndex> splitters;
  for (const v1::SectorIndex& splitter : messages) splitters.push_back(from_proto(splitter));
  return SectorMap::checked(anchor, std::move(splitters), {owners.begin(), owners.end()}, servers, epoch);
}

absl::Status fill(Partition& partition, const v1::LoadWorld& load) {
  absl::StatusOr<std::vector<BodyRecord>> records = unpack_records(load.records());
  if (!records.ok()) return records.status();
  const absl::StatusOr<std::vector<JointRecord>> joints = unpack_joints(load.joints());
  if (!joints.ok()) return joints.status();
  if (absl::Status status = check(partition, *records, *joints); !status.ok()) return status;
  for (const BodyRecord& record : *records) add_body(partition, record);
  add_joints(partition, *joints);
  absl::Status status = bounded("the largest radius", load.radius_max(), 0, partition.sector_size(), "m");
  if (!status.ok()) return status;
  expect_radius(partition, load.radius_max());
  return absl::OkStatus();
}

absl::Status restore(Partition& partition, const v1::Restored& restored, bool is_guest) {
  absl::StatusOr<SharedState> shared = unpack_shared(restored.shared());
  if (!shared.ok()) return shared.status();
  std::vector<MovedSector> sectors;
  for (const std::string& list : restored.sectors()) {
    absl::StatusOr<std::vector<MovedSector>> some = unpack_sectors(list);
    if (!some.ok()) return some.status();
    std::move(some->begin(), some->end(), std::back_inserter(sectors));
  }
  if (absl::Status status = check(partition, *shared, sectors); !status.ok()) return status;
  // A guest does not hear what has become of these; it is told once it takes part.
  if (is_guest) shared->known_replicas.clear();
  return resume(partition, *shared, sectors);
}

}  // namespace

absl::StatusOr<WorldSettings> settings_of(const v1::LoadWorld& load) {
  absl::StatusOr<WorldSettings> settings = from_proto(load.settings());
  if (!settings.ok()) return settings.status();
  if (absl::Status status = validate(*settings); !status.ok()) return status;
  return settings;
}

absl::StatusOr<std::unique_ptr<Partition>> loaded_partition(v1::LoadWorld& load,
                                                            const WorldSettings& settings, Engine& engine,
                                                            std::size_t servers, Rank self) {
  const SectorIndex anchor = from_proto(load.anchor());
  absl::StatusOr<SectorMap> map =
      read_map(anchor, load.splitters(), load.owners(), servers, load.map_epoch());
  if (!map.ok()) return map.status();
  PartitionOptions options;
  options.settings = settings;
  options.anchor = anchor;
  options.map = *std::move(map);
  options.self = self;
  if (absl::Status status = can_run(settings.modules); !status.ok()) return status;
  auto partition = std::make_unique<Partition>(std::move(options), engine);
  if (absl::Status status = add_shapes(*partition, *load.mutable_shapes()); !status.ok()) return status;
  absl::Status filled = load.has_restored()
                            ? restore(*partition, load.restored(), /*is_guest=*/self >= servers)
                            : fill(*partition, load);
  if (!filled.ok()) return filled;
  return partition;
}

absl::StatusOr<SectorMap> map_of(const Partition& partition, const v1::SectorMap& message,
                                 std::size_t servers) {
  return read_map(partition.anchor, message.splitters(), message.owners(), servers, message.epoch());
}

absl::Status add_shapes(Partition& partition, google::protobuf::RepeatedPtrField<v1::NumberedShape>& shapes) {
  for (v1::NumberedShape& message : shapes) {
    absl::StatusOr<Shape> shape = from_proto(message.shape());
    if (!shape.ok()) return shape.status();
    const std::unique_ptr<const v1::Shape> taken(message.release_shape());
    const std::string title = absl::StrCat("shape ", message.id());
    if (absl::Status status = validate(*shape, title); !status.ok()) return status;
    if (partition.shapes.contains(message.id()))
      return absl::InvalidArgumentError(absl::StrCat(title, " is there already"));
    if (absl::Status status = open_grounds(std::span<const Shape>(&*shape, 1)); !status.ok()) return status;
    add_shape(partition, message.id(), std::make_shared<const Shape>(*std::move(shape)));
  }
  return absl::OkStatus();
}

absl::Status add_modules(Partition& partition, google::protobuf::RepeatedPtrField<std::string>& modules) {
  for (std::string& bytes : modules) {
    absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module(std::move(bytes));
    if (!module.ok()) return module.status();
    if (absl::Status status = can_run({*module}); !status.ok()) return status;
    add_module(partition, *module);
  }
  if (partition.settings.modules.size() <= kModulesMax) return absl::OkStatus();
  return refused("modules: their number ", partition.settings.modules.size(), " must be at most ",
                 kModulesMax);
}

}  // namespace tessera
