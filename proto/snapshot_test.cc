// A world that is restored from a snapshot goes on as the one that was not stopped.
#include "proto/snapshot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "lpss/engine/test_world.h"
#include "lpss/programs/module.h"
#include "lpss/programs/registry.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/partition_cluster.h"
#include "lpss/wasm/test_modules.h"
#include "proto/snapshot_file.h"
#include "proto/wire.h"

namespace tessera {
namespace {

using testing::HasSubstr;

WorldSettings in_sectors(double size) {
  WorldSettings settings;
  settings.sector_size = size;
  settings.precision = engine_tests::test_precision;
  return settings;
}

// Something of everything: contacts over borders, joints, one of them led by a kinematic body, sleepers.
WorldDescription busy_world() {
  WorldDescription pile = pile_world(in_sectors(3), 60);
  WorldBuilder builder(pile.settings);
  builder.world() = std::move(pile);
  builder.add_chain(8, {0.2, 3, 9}, {1, 0, 0});
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
  builder.add("leader", box, 1, {-4, 6, 6}, Motion::kKinematic);
  builder.add("follower", box, 1, {-2.9, 6, 6});
  builder.tie("lead", JointType::kBall, "leader", "follower", {-3.4, 6, 6});
  return builder.world();
}

// Equal where all that lasts is.
std::size_t digest(const std::string& bytes) { return std::hash<std::string>()(bytes); }

// What all that lasts packs to: the shared state first, then sector by sector. While sectors move, islands at
// rest are reported as often as their sectors come to another server, which is no part of the state.
std::vector<std::size_t> digests_of(const WorldSnapshot& world) {
  std::vector<std::size_t> digests = {digest(pack(world.shared))};
  for (MovedSector sector : world.sectors) {
    if (world.settings.shuffle != 0) sector.parts.clear();
    digests.push_back(digest(pack(std::span(&sector, 1))));
  }
  return digests;
}

std::unique_ptr<PartitionCluster> started(const WorldDescription& world, std::uint32_t partitions) {
  auto cluster = PartitionCluster::create(world, partitions);
  EXPECT_TRUE(cluster.ok()) << cluster.status();
  return *std::move(cluster);
}

// A push every few ticks, at one body or another.
std::vector<Command> commands_at(Tick tick) {
  if (tick % 20 != 7) return {};
  return {ApplyImpulse{BodyId{2 + tick % 50}, {1, -2, 3}, {0.1, 0, 0}}};
}

void expect_to_go_on(const WorldDescription& world, int before, int after) {
  const auto undisturbed = started(world, 2);
  for (int n = 0; n < before; ++n) undisturbed->step(commands_at(undisturbed->tick() + 1));
  const WorldSnapshot taken = undisturbed->snapshot();
  const absl::StatusOr<ReadSnapshot> read = from_chunks(chunks_of(taken, catalogue_of(world)));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(digests_of(read->world), digests_of(taken));

  std::vector<std::unique_ptr<PartitionCluster>> restored;
  for (const std::uint32_t partitions : {1u, 2u, 5u}) {
    auto cluster = PartitionCluster::restore(read->world, partitions);
    ASSERT_TRUE(cluster.ok()) << cluster.status();
    EXPECT_EQ(digests_of((*cluster)->snapshot()), digests_of(taken)) << partitions << " partitions";
    restored.push_back(*std::move(cluster));
  }
  for (int n = 0; n < after; ++n) {
    const std::vector<Command> commands = commands_at(undisturbed->tick() + 1);
    undisturbed->step(commands);
    const std::vector<std::size_t> expected = digests_of(undisturbed->snapshot());
    for (const auto& cluster : restored) {
      cluster->step(commands);
      ASSERT_EQ(cluster->tick(), undisturbed->tick());
      ASSERT_EQ(cluster->hash(), undisturbed->hash()) << cluster->size() << " at " << cluster->tick();
      ASSERT_EQ(digests_of(cluster->snapshot()), expected) << cluster->size() << " at " << cluster->tick();
    }
  }
}

TEST(Snapshot, AWorldThatMovesGoesOn) { expect_to_go_on(busy_world(), 45, 150); }

TEST(Snapshot, AWorldFromItsStartGoesOn) { expect_to_go_on(busy_world(), 0, 60); }

TEST(Snapshot, AWorldAsleepGoesOn) { expect_to_go_on(pile_world(in_sectors(4), 60), 900, 200); }

TEST(Snapshot, AWorldWhoseSectorsMoveGoesOn) {
  WorldDescription world = busy_world();
  world.settings.shuffle = 7;
  expect_to_go_on(world, 50, 100);
}

TEST(Snapshot, AWorldOfClonesGoesOn) {
  WorldDescription world = pile_world(in_sectors(4), 30);
  world.settings.seams = SeamPolicy::kClone;
  expect_to_go_on(world, 40, 60);
}

// Spawns and removals, whose shapes come and go, ids beyond 32 bits among them.
TEST(Snapshot, AWorldWithAModuleGoesOn) {
  WorldDescription world = busy_world();
  std::string bytes =
      wasm::test_module(R"((module
      (import "tessera" "values" (func $values (param i32)))
      (import "tessera" "set_values" (func $set_values (param i32)))
      (import "tessera" "random" (func $random (param i32) (result f64)))
      (import "tessera" "push_awake" (func $push (param f64 f64 f64 f64 f64 f64)))
      (memory 1)
      (func (export "run")
        (call $values (i32.const 0))
        (f64.store (i32.const 0) (f64.add (f64.load (i32.const 0)) (call $random (i32.const 0))))
        (call $push (f64.load (i32.const 0)) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0))
        (call $set_values (i32.const 0)))))",
                        "program | adder | Adds.\nvalue | sum | | 0.5 | Of numbers by chance.\n");
  absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module(std::move(bytes));
  ASSERT_TRUE(module.ok()) << module.status();
  world.bodies[3].programs.push_back(*new_program((*module)->kind));
  world.settings.modules = {*module};
  expect_to_go_on(world, 45, 60);

  // A process that has never had the module gets it with the snapshot.
  const std::vector<v1::SnapshotChunk> chunks = chunks_of(started(world, 1)->snapshot(), catalogue_of(world));
  const std::string kind = (*module)->kind;
  *module = nullptr;
  world = {};
  EXPECT_EQ(find_program(kind), nullptr);
  const absl::StatusOr<ReadSnapshot> read = from_chunks(chunks);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->world.settings.modules.at(0)->kind, kind);
  EXPECT_NE(find_program(kind), nullptr);
}

TEST(Snapshot, ShapesAreKnownByTheirIds) {
  const WorldDescription world = tower_world(in_sectors(4), 3, {0, 0, -1});
  const auto cluster = started(world, 2);
  const ShapeId first = world.shapes.size();
  const ShapeId second = ShapeId{1} << 40;
  BodyRecord ball = records_of(world)->back();
  WorldCatalogue catalogue = catalogue_of(world);
  for (const ShapeId shape : {first, second}) {
    ball.id = BodyId{shape == first ? 1000 : kBodyIdMax - 1};
    ball.properties.shape = shape;
    ball.state.position = {0, 0, shape == first ? 1.0 : 1.6};
    cluster->add_shape(shape, std::make_shared<const Shape>(Shape{{{Sphere{0.25}, {}}}}));
    cluster->step(std::vector<Command>{SpawnBody{ball}});
  }
  catalogue.bodies.push_back({ball.id, "ball", ball.properties});
  catalogue.next_body = BodyId{kBodyIdMax};
  catalogue.next_shape = second + 1;
  cluster->step(std::vector<Command>{RemoveBody{BodyId{1000}, first}});
  const WorldSnapshot taken = cluster->snapshot();
  EXPECT_EQ(find_shape(taken.shapes, first), nullptr);
  EXPECT_NE(find_shape(taken.shapes, second), nullptr);

  const absl::StatusOr<ReadSnapshot> read = from_chunks(chunks_of(taken, catalogue));
  ASSERT_TRUE(read.ok()) << read.status();
  const auto restored = PartitionCluster::restore(read->world, 1);
  ASSERT_TRUE(restored.ok()) << restored.status();
  for (int n = 0; n < 60; ++n) {
    cluster->step();
    (*restored)->step();
    ASSERT_EQ((*restored)->hash(), cluster->hash()) << n;
  }

  catalogue.next_shape = second;
  EXPECT_THAT(from_chunks(chunks_of(taken, catalogue)).status().message(),
              testing::HasSubstr("the id must be below the next one"));
  catalogue.next_shape = second + 1;
  catalogue.held.push_back({{RemoveBody{ball.id, second}}, {}});
  EXPECT_THAT(from_chunks(chunks_of(taken, catalogue)).status().message(),
              testing::HasSubstr("there is no shape"))
      << "the ball still has it";
  catalogue.bodies.pop_back();
  EXPECT_TRUE(from_chunks(chunks_of(taken, catalogue)).ok());
  catalogue.held.push_back({{RemoveBody{ball.id, second}}, {}});
  EXPECT_THAT(from_chunks(chunks_of(taken, catalogue)).status().message(),
              testing::HasSubstr("which is not there"));
}

// A command that has been accepted, and has not taken effect, has changed what its name says.
TEST(Snapshot, ABodyMayMoveOtherwiseThanItWillAfterHeldCommands) {
  const WorldDescription world = tower_world(in_sectors(4), 3, {0, 0, -1});
  const auto cluster = started(world, 2);
  cluster->step();
  const WorldSnapshot taken = cluster->snapshot();
  WorldCatalogue catalogue = catalogue_of(world);
  WorldCatalogue::Body& top = catalogue.bodies.back();
  top.properties.motion = Motion::kKinematic;
  EXPECT_THAT(from_chunks(chunks_of(taken, catalogue)).status().message(),
              testing::HasSubstr("belongs to one that moves otherwise"));
  catalogue.held.push_back({{SetProperties{top.id, top.properties}}, {}});
  EXPECT_TRUE(from_chunks(chunks_of(taken, catalogue)).ok());
  top.properties.motion = Motion::kStatic;
  EXPECT_FALSE(from_chunks(chunks_of(taken, catalogue)).ok()) << "nothing becomes static";
}

std::vector<v1::SnapshotChunk> small_snapshot() {
  const WorldDescription world = tower_world(in_sectors(4), 3, {0, 0, -1});
  const auto cluster = started(world, 1);
  for (int n = 0; n < 30; ++n) cluster->step();
  return chunks_of(cluster->snapshot(), catalogue_of(world));
}

class SnapshotFile : public testing::Test {
 protected:
  // Tests of both precisions run at the same time.
  SnapshotFile()
      : folder_(testing::TempDir() + "/snapshot_file_" + name_of(engine_tests::test_precision) + "_" +
                testing::UnitTest::GetInstance()->current_test_info()->name()) {
    std::filesystem::create_directories(folder_);
  }
  ~SnapshotFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path file(const std::string& name) const { return folder_ / name; }

  static std::string contents(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

 private:
  std::filesystem::path folder_;
};

TEST_F(SnapshotFile, IsReadAsWritten) {
  const std::vector<v1::SnapshotChunk> chunks = small_snapshot();
  ASSERT_TRUE(write_snapshot(file("a"), chunks).ok());
  const auto read = read_snapshot(file("a"));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), chunks.size());
  for (std::size_t n = 0; n < chunks.size(); ++n) {
    EXPECT_EQ((*read)[n].SerializeAsString(), chunks[n].SerializeAsString());
  }
  EXPECT_FALSE(std::filesystem::exists(file("a.part")));
}

TEST_F(SnapshotFile, AnyByteFlippedAndAnyPrefixIsRefused) {
  WorldBuilder builder(in_sectors(4));
  builder.add("ball", builder.shape(Sphere{0.5}), 1, {0, 0, 0});
  ASSERT_TRUE(write_snapshot(file("a"), chunks_of(started(builder.world(), 1)->snapshot(),
                                                  catalogue_of(builder.world())))
                  .ok());
  const std::string whole = contents(file("a"));
  const auto expect_refused = [&](const std::string& bytes, const std::string& what) {
    SnapshotDecoder decoder;
    absl::Status status = decoder.add(bytes);
    if (status.ok()) status = decoder.finish().status();
    ASSERT_EQ(status.code(), absl::StatusCode::kDataLoss) << what << ": " << status;
  };
  for (std::size_t byte = 0; byte < whole.size(); ++byte) {
    std::string damaged = whole;
    damaged[byte] = static_cast<char>(damaged[byte] ^ (1 << (byte % 8)));
    expect_refused(damaged, "byte " + std::to_string(byte));
    expect_refused(whole.substr(0, byte), "prefix of " + std::to_string(byte));
  }
  expect_refused(whole + '\0', "one byte more");
  SnapshotDecoder decoder;
  for (const char byte : whole) ASSERT_TRUE(decoder.add({&byte, 1}).ok());
  EXPECT_TRUE(decoder.finish().ok());
}

TEST_F(SnapshotFile, OfAnOldOneNothingIsLostWhereTheNewOneCannotBeWritten) {
  EXPECT_EQ(write_snapshot(file("no/folder"), small_snapshot()).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(read_snapshot(file("none")).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(read_snapshot(file("")).ok());
}

// Whatever packed bytes say that no checksum guards, they are an error or a world.
TEST(Snapshot, PackedBytesThatAreDamagedAreRefusedOrAWorld) {
  const std::vector<v1::SnapshotChunk> small = small_snapshot();
  const WorldDescription chain = chain_world(in_sectors(4), 4, {1, 0, 0});
  const std::vector<v1::SnapshotChunk> jointed =
      chunks_of(started(chain, 1)->snapshot(), catalogue_of(chain));
  std::mt19937 dice(1);
  int refused = 0;
  for (int round = 0; round < 4000; ++round) {
    std::vector<v1::SnapshotChunk> damaged = round % 2 == 0 ? small : jointed;
    for (v1::SnapshotChunk& chunk : damaged) {
      std::string* bytes = chunk.has_shared()    ? chunk.mutable_shared()
                           : chunk.has_sectors() ? chunk.mutable_sectors()
                                                 : nullptr;
      if (bytes == nullptr) continue;
      (*bytes)[dice() % bytes->size()] = static_cast<char>(dice());
    }
    const auto read = from_chunks(damaged);
    if (!read.ok()) {
      ++refused;
      continue;
    }
    const auto cluster = PartitionCluster::restore(read->world, 2);
    if (!cluster.ok()) continue;
    EXPECT_EQ((*cluster)->tick(), read->world.tick);
  }
  EXPECT_GT(refused, 200);
}

// What a snapshot says of joints where they are known is what its joints say.
TEST(Snapshot, JointsThatContradictEachOtherAreRefused) {
  WorldDescription world = busy_world();
  world.joints[3].properties.type = JointType::kRevolute;
  world.joints[5].properties.type = JointType::kRevolute;
  world.joints[3].properties.axes[0].mimic.leader = JointId{6};
  const WorldSnapshot whole = started(world, 2)->snapshot();
  ASSERT_TRUE(validate(whole).ok());
  const auto refusal = [&](const std::function<void(BodyJoints&)>& spoil) {
    WorldSnapshot spoilt = whole;
    for (MovedSector& sector : spoilt.sectors) {
      for (MovedBody& body : sector.bodies) {
        const bool follows = !body.joints.as_child.empty() && body.joints.as_child[0].record.id == JointId{4};
        if (follows) spoil(body.joints);
      }
    }
    return std::string(validate(spoilt).message());
  };
  EXPECT_THAT(refusal([](BodyJoints& joints) { joints.as_child[0].record.id = {}; }),
              HasSubstr("at least 1"));
  EXPECT_THAT(refusal([](BodyJoints& joints) { joints.as_child[0].record.id = JointId{5}; }),
              HasSubstr("joint 5: the id is given twice"));
  EXPECT_THAT(refusal([](BodyJoints& joints) { joints.as_child[0].record.properties.child = BodyId{1}; }),
              HasSubstr("joint 4: it is not with its child"));
  EXPECT_THAT(refusal([](BodyJoints& joints) {
                joints.as_child[0].record.properties.axes[0].mimic.leader = JointId{99};
              }),
              HasSubstr("joint 4: the joint 99, which it follows, is not there"));
  EXPECT_THAT(refusal([](BodyJoints& joints) { joints.as_child[0].coupled.clear(); }),
              HasSubstr("joint 4: the joints that it lists are not those"));
  EXPECT_THAT(refusal([](BodyJoints& joints) { joints.as_parent.clear(); }),
              HasSubstr("the joints that it lists are not those that it is parent of"));
  WorldSnapshot told = whole;
  told.shared.joints.push_back({JointId{1}, BodyId{1}, BodyId{2}});
  EXPECT_THAT(validate(told).message(), HasSubstr("the joints that all servers know must be none"));
}

TEST(Snapshot, OfAnotherVersionIsRefused) {
  std::vector<v1::SnapshotChunk> chunks = small_snapshot();
  chunks.front().mutable_head()->set_version(kStoredVersion + 1);
  EXPECT_THAT(from_chunks(chunks).status().message(),
              HasSubstr("its format is 9, and this one reads 4 to 8"));
  chunks = small_snapshot();
  chunks.front().mutable_head()->set_layout(1);
  EXPECT_THAT(from_chunks(chunks).status().message(), HasSubstr("an unfinished 8"));
  chunks = small_snapshot();
  chunks.front().mutable_head()->set_arithmetic(1);
  EXPECT_THAT(from_chunks(chunks).status().message(), HasSubstr("other bits"));
}

TEST(Snapshot, LacksNoChunk) {
  const std::vector<v1::SnapshotChunk> chunks = small_snapshot();
  for (std::size_t n = 0; n < chunks.size(); ++n) {
    std::vector<v1::SnapshotChunk> less = chunks;
    less.erase(less.begin() + static_cast<std::ptrdiff_t>(n));
    EXPECT_EQ(from_chunks(less).status().code(), absl::StatusCode::kDataLoss) << "without chunk " << n;
    std::vector<v1::SnapshotChunk> more = chunks;
    more.insert(more.begin() + static_cast<std::ptrdiff_t>(n), chunks[n]);
    EXPECT_FALSE(from_chunks(more).ok()) << "with chunk " << n << " twice";
  }
}

}  // namespace
}  // namespace tessera
