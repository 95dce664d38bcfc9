#include "proto/wire.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <new>
#include <random>

#include "proto/archive.h"

namespace tessera {
namespace {

BodyRecord some_record(std::uint64_t id) {
  BodyRecord record;
  record.id = BodyId{id};
  record.home = {-1, std::int64_t{1} << 62, static_cast<std::int64_t>(id)};
  record.properties.motion = Motion::kKinematic;
  record.properties.shape = 7;
  record.properties.mass = 0.1;
  record.properties.inertia = {1, 2, 3};
  record.properties.centre = {-0.0, 1e-300, 3};
  record.properties.principal_axes = {0.5, 0.5, 0.5, 0.5};
  record.properties.category = 0x80000001;
  record.properties.gravity = false;
  record.properties.assembly = 77;
  record.properties.trigger = true;
  if (id % 2 == 1) record.properties.surface = Surface{{1, 2, 3}, 0.1, 0.2, 0.3, 0.4, {5, 6, 7}, {8, 9, 10}};
  record.state.position = {1.0 / 3, -2, 63.999};
  record.state.linear_velocity = {1, 2, 3};
  record.state.angular_velocity = {4, 5, 6};
  record.state.still_for = 0.25;
  record.state.activity = Activity::kWantsSleep;
  if (id % 2 == 1) record.state.velocities_before = Velocities{{7, 8, 9}, {10, 11, 12}};
  return record;
}

JointRecord some_joint(std::uint64_t id) {
  JointRecord record;
  record.id = JointId{id};
  record.properties.type = JointType::kUniversal;
  record.properties.parent = BodyId{3};
  record.properties.child = BodyId{4};
  record.properties.anchor = {-1, 2, std::int64_t{1} << 62};
  record.properties.in_parent = {{1.0 / 3, -0.0, 3}, Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)};
  record.properties.in_child = {{4, 5, 6}, Eigen::Quaterniond(0, 1, 0, 0)};
  record.properties.axes[0] = {-1, kUnbounded, 2, 3, 4, 5, 6, -7, 8, {JointId{9}, 1, -3.7, 0.1, 1.0 / 3}};
  record.properties.axes[1].friction = 0.1;
  record.properties.pitch = -0.01;
  record.properties.bodies_collide = true;
  record.parent_motion = Motion::kKinematic;
  record.drives = {JointDrive{DriveMode::kPosition, 0.5}, JointDrive{DriveMode::kServo, -7, 8, 9, 10, 11}};
  return record;
}

ManifoldState some_manifold() { return {BodyId{1}, BodyId{2}, std::string("\0points\xff", 8)}; }

OffsetSet corners() {
  OffsetSet set;
  set.insert(-2, -2, -2);
  set.insert(2, 2, 2);
  set.insert(0, 0, 1);
  return set;
}

BodyRecord some_programmed(std::uint64_t id) {
  BodyRecord record = some_record(id);
  record.programs = {{"character", {1, 2}, {3}, {4, 5}, 6, {7, 8, 9}, {10, 11, 12}, "a fault"}, {}};
  return record;
}

std::vector<Command> some_commands() {
  return {SpawnBody{some_programmed(3)},
          RemoveBody{BodyId{4}},
          SetVelocity{BodyId{5}, {1, 2, 3}, {4, 5, 6}},
          ApplyImpulse{BodyId{6}, {7, 8, 9}, {10, 11, 12}},
          ApplyForce{BodyId{7}, {{1, 2, 3}, {4, 5, 6}}},
          Teleport{BodyId{8}, {1, 2, 3}, some_record(1).state, false, true, false, true},
          KinematicTarget{BodyId{9}, {4, 5, 6}, some_record(1).state, true},
          AddJoint{some_joint(10), {tie_of(some_joint(9))}},
          RemoveJoint{JointId{11}},
          SetDrives{JointId{12}, some_joint(1).drives},
          SetSurfaceMotion{BodyId{13}, {1, 2, 3}, {4, 5, 6}},
          SetProperties{BodyId{14}, some_record(3).properties},
          ApplyRadialImpulse{{1, 2, 3}, {4, 5, 6}, 7, -8, 9},
          SetForce{BodyId{15}, LastingForce{{{1, 2, 3}, {4, 5, 6}}, true}},
          PushBody{BodyId{16}, {{1, 2, 3}, {4, 5, 6}}},
          TellProgram{BodyId{17}, 2, {{0, 1.5}, {3, -2}}, {{1, 0.25}}}};
}

BodyJoints some_joints() {
  return {{{some_joint(1), {tie_of(some_joint(9))}}, {some_joint(2), {}}}, {tie_of(some_joint(3))}};
}

Exchange some_exchange() {
  Exchange exchange;
  exchange.introductions = {{BodyId{1}, some_record(1).properties}, {BodyId{2}, {}}};
  exchange.replicas = {{BodyId{1}, {1, 2, 3}, {1, 2, 4}, corners(), some_record(1).state, true}};
  exchange.gone = {BodyId{3}, BodyId{4}, BodyId{5}};
  exchange.handovers = {{some_record(6), corners()}};
  exchange.handovers[0].joints = some_joints();
  exchange.manifolds = {{{9, 8, 7}, true, some_manifold()}};
  return exchange;
}

Seams some_seams() {
  IslandPart part{{BodyId{1}, BodyId{9}}, BodyId{1}, 3, 4, true, false, 8, true, false};
  return {{{{1, 2, 3}, {part, {}}}, {{4, 5, 6}, {}}}};
}

Shipment some_shipment() {
  const ShippedIsland island{
      BodyId{1},      {{BodyId{1}, {1, 2, 3}, 4, 7}}, {{BodyId{1}, BodyId{2}, 8}}, "numbers", "numb\0ers",
      {some_joint(1)}};
  return {{island}, {island, {}}};
}

Solution some_solution() { return {{{BodyId{1}, "bodies", "pairs"}}, {{BodyId{3}, JointId{2}}}}; }

// Packs, unpacks and packs again; then all prefixes and many corruptions must be refused or read, never
// crash.
template <typename Unpack>
void torture(const std::string& bytes, const Unpack& unpack) {
  const auto whole = unpack(bytes);
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_EQ(pack(*whole), bytes);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string prefix = bytes.substr(0, size);  // a copy: sanitizers see a read behind it
    EXPECT_EQ(unpack(prefix).status().code(), absl::StatusCode::kDataLoss) << size;
  }
  EXPECT_EQ(unpack(bytes + '\0').status().code(), absl::StatusCode::kDataLoss);

  std::mt19937_64 random(1);
  for (int n = 0; n < 20'000; ++n) {
    std::string damaged = bytes;
    const int flips = 1 + static_cast<int>(random() % 3);
    for (int flip = 0; flip < flips; ++flip)
      damaged[random() % damaged.size()] ^= static_cast<char>(1 << random() % 8);
    const auto result = unpack(damaged);
    if (result.ok()) {
      EXPECT_EQ(pack(*result), damaged);
    } else {
      EXPECT_EQ(result.status().code(), absl::StatusCode::kDataLoss);
    }
  }
}

Agreement some_agreement() {
  return {.quiet = false,
          .goes_on = true,
          .calls = {{3, 70}, {4, 5}},
          .joint_ends = {{BodyId{7}, BodyId{8}, 2}},
          .joint_hosts = {{1, BodyId{9}, 6}}};
}

Transfer some_transfer() {
  MovedSector moved;
  moved.sector = {1, -2, 3};
  moved.bodies.push_back(
      {some_record(3), corners(), true, SectorIndex{1, -2, 4}, some_record(4).state, true, some_joints()});
  moved.bodies.push_back({some_record(5), {}, false, std::nullopt, std::nullopt, false, {}});
  moved.clones.push_back({{BodyId{7}, some_record(7).properties}, {}, true, true});
  moved.manifolds.push_back(some_manifold());
  moved.touching.push_back({BodyId{3}, BodyId{7}});
  moved.overlaps.push_back({BodyId{9}, BodyId{7}});
  moved.static_region = {-1, -2, -3, 4, 5, 6};
  moved.parts_reported = true;
  return {{moved}};
}

TEST(Wire, BodyRecordsSurviveBitForBit) {
  const std::vector<BodyRecord> records{some_record(1), some_record(2), BodyRecord{}};
  torture(pack(std::span<const BodyRecord>(records)), [](std::string_view b) { return unpack_records(b); });
  const auto read = unpack_records(pack(std::span<const BodyRecord>(records)));
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->size(), 3u);
  EXPECT_EQ((*read)[0].id, BodyId{1});
  EXPECT_EQ((*read)[0].home, records[0].home);
  EXPECT_EQ((*read)[0].properties.motion, Motion::kKinematic);
  EXPECT_EQ((*read)[0].properties.category, 0x80000001u);
  EXPECT_TRUE(std::signbit((*read)[0].properties.centre[0]));
  EXPECT_FALSE((*read)[0].properties.gravity);
  EXPECT_EQ((*read)[0].state.position, records[0].state.position);
  EXPECT_EQ((*read)[0].properties.assembly, 77u);
  EXPECT_TRUE((*read)[0].properties.trigger);
  EXPECT_EQ((*read)[0].state.activity, Activity::kWantsSleep);
}

JointRecord with_one_axis(JointRecord joint) {
  joint.properties.type = JointType::kRevolute;
  return joint;
}

TEST(Wire, JointRecordsSurviveBitForBit) {
  const std::vector<JointRecord> joints{some_joint(1), some_joint(2), with_one_axis(some_joint(3)),
                                        JointRecord{}};
  torture(pack(std::span<const JointRecord>(joints)), [](std::string_view b) { return unpack_joints(b); });
  const auto read = unpack_joints(pack(std::span<const JointRecord>(joints)));
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->size(), 4u);
  EXPECT_EQ((*read)[2].properties.axes[0].spring_stiffness, 6);
  const JointRecord& joint = (*read)[0];
  EXPECT_EQ(joint.id, JointId{1});
  EXPECT_EQ(joint.properties.type, JointType::kUniversal);
  EXPECT_EQ(joint.properties.anchor, joints[0].properties.anchor);
  EXPECT_EQ(joint.properties.in_parent.orientation.coeffs(),
            joints[0].properties.in_parent.orientation.coeffs());
  EXPECT_TRUE(std::signbit(joint.properties.in_parent.position.y()));
  EXPECT_EQ(joint.properties.axes[0].upper, kUnbounded);
  EXPECT_EQ(joint.properties.axes[0].spring_stiffness, 6);
  EXPECT_EQ(joint.properties.axes[0].spring_reference, -7);
  const AxisMimic& mimic = joint.properties.axes[0].mimic;
  EXPECT_EQ(mimic.leader, JointId{9});
  EXPECT_EQ(mimic.axis, 1);
  EXPECT_EQ((std::array{mimic.multiplier, mimic.reference, mimic.offset}), (std::array{-3.7, 0.1, 1.0 / 3}));
  EXPECT_EQ(joint.properties.axes[1].friction, 0.1);
  EXPECT_EQ(joint.parent_motion, Motion::kKinematic);
  EXPECT_EQ(joint.drives, joints[0].drives);
}

TEST(Wire, CommandsSurviveBitForBit) {
  const std::vector<Command> commands = some_commands();
  ASSERT_EQ(commands.size(), std::variant_size_v<Command>);
  torture(pack(std::span<const Command>(commands)), [](std::string_view b) { return unpack_commands(b); });
  const auto read = unpack_commands(pack(std::span<const Command>(commands)));
  ASSERT_TRUE(read.ok());
  for (std::size_t n = 0; n < commands.size(); ++n) EXPECT_EQ((*read)[n].index(), n);
  EXPECT_EQ(std::get<ApplyForce>((*read)[4]).wrench.torque, (std::array<double, 3>{4, 5, 6}));
  const auto& jump = std::get<Teleport>((*read)[5]);
  EXPECT_EQ(jump.home, (SectorIndex{1, 2, 3}));
  EXPECT_FALSE(jump.keeps_rotation);
  EXPECT_TRUE(jump.keeps_linear_velocity);
  EXPECT_FALSE(jump.keeps_angular_velocity);
  EXPECT_TRUE(jump.keeps_contacts);
  EXPECT_TRUE(std::get<SetForce>((*read)[13]).force->turns_along);
  EXPECT_EQ(std::get<TellProgram>((*read)[15]).inputs, std::get<TellProgram>(commands[15]).inputs);
  EXPECT_EQ(std::get<SpawnBody>((*read)[0]).record.programs.at(0).fault, "a fault");
  EXPECT_TRUE(std::get<KinematicTarget>((*read)[6]).keeps_rotation);
  EXPECT_EQ(std::get<SetDrives>((*read)[9]).drives, some_joint(1).drives);
  EXPECT_EQ(std::get<SetSurfaceMotion>((*read)[10]).running, (std::array<double, 3>{4, 5, 6}));
  EXPECT_EQ(std::get<SetProperties>((*read)[11]).properties.inertia, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(std::get<ApplyRadialImpulse>((*read)[12]).impulse, -8);
  EXPECT_EQ(std::get<SpawnBody>((*read)[0]).record.properties.surface, some_record(3).properties.surface);
}

TEST(Wire, PackedCommandsAreTheBytesOfAList) {
  const std::vector<Command> commands = some_commands();
  PackedCommands packed;
  EXPECT_EQ(packed.list(), pack(std::span<const Command>()));
  packed.append(std::span(commands).first(3));
  packed.append(std::span(commands).subspan(3));
  EXPECT_EQ(packed.size(), commands.size());
  EXPECT_EQ(packed.list(), pack(std::span(commands)));
  EXPECT_EQ(pack(std::span<const Command>(packed.unpacked())), packed.list());
}

TEST(Wire, RoundsSurviveBitForBit) {
  const std::vector<RoundMessage> rounds{
      some_agreement(),
      some_transfer(),
      some_exchange(),
      std::make_shared<const Seams>(some_seams()),
      some_shipment(),
      Motions{"motions"},
      some_solution(),
      ProgramAsks{true,
                  false,
                  {{ProgramAsk::kInside, BodyId{1}, JointId{2}, {1, 2, 3}, {4, 5, 6}, {0, 0, 1}, 7, 0.5, 3}}},
      ProgramAnswers{{{1, BodyId{2}, Motion::kKinematic, 3, {0, 0, 1}, {4, 5, 6}, {7, 8, 9}}},
                     {{1, JointId{3}, some_joint(3), JointSide{}, {}}, {2, JointId{4}, {}, {}, JointSide{}}}},
      ProgramActs{{{BodyId{1}, 2, PushBody{BodyId{1}, {{1, 2, 3}, {4, 5, 6}}}}}}};
  ASSERT_EQ(rounds.size(), std::variant_size_v<RoundMessage>);
  for (std::size_t n = 0; n < rounds.size(); ++n) {
    torture(pack(rounds[n]), [](std::string_view b) { return unpack_round(b); });
    EXPECT_EQ(unpack_round(pack(rounds[n]))->index(), n);
  }
  const auto read = unpack_round(pack(RoundMessage(some_exchange())));
  const Exchange& exchange = std::get<Exchange>(*read);
  EXPECT_EQ(exchange.replicas[0].replicated_in, corners());
  EXPECT_EQ(exchange.manifolds[0].manifold.points, some_manifold().points);
  EXPECT_TRUE(exchange.manifolds[0].was_touching);
  EXPECT_TRUE(exchange.replicas[0].known_everywhere);
  const BodyJoints& joints = exchange.handovers[0].joints;
  EXPECT_EQ(joints.as_child[0].record.drives, some_joint(1).drives);
  EXPECT_EQ(joints.as_child[0].coupled, some_joints().as_child[0].coupled);
  EXPECT_EQ(joints.as_parent, some_joints().as_parent);
  const auto command = unpack_commands(pack(std::span<const Command>(some_commands())));
  EXPECT_EQ(std::get<AddJoint>((*command)[7]).leaders, (std::vector<JointTie>{tie_of(some_joint(9))}));
}

TEST(Wire, EmptyMessages) {
  EXPECT_TRUE(unpack_records(pack(std::span<const BodyRecord>())).value().empty());
  EXPECT_TRUE(unpack_commands(pack(std::span<const Command>())).value().empty());
  EXPECT_TRUE(unpack_round(pack(RoundMessage(Exchange{}))).ok());
  EXPECT_TRUE(unpack_round(pack(RoundMessage(std::make_shared<const Seams>()))).ok());
}

// Memory whose padding holds other bytes must not show.
TEST(Wire, EqualValuesAreEqualBytes) {
  alignas(BodyRecord) unsigned char dirty[sizeof(BodyRecord)];
  alignas(BodyRecord) unsigned char clean[sizeof(BodyRecord)];
  std::memset(dirty, 0xa5, sizeof dirty);
  std::memset(clean, 0, sizeof clean);
  const auto fill = [](BodyRecord* record) {
    const BodyRecord source = some_record(1);
    record->id = source.id;
    record->home = source.home;
    record->properties.motion = source.properties.motion;
    record->properties.gravity = source.properties.gravity;
    record->state.activity = source.state.activity;
  };
  BodyRecord* a = new (dirty) BodyRecord;
  BodyRecord* b = new (clean) BodyRecord;
  fill(a);
  fill(b);
  EXPECT_EQ(pack(std::span<const BodyRecord>(a, 1)), pack(std::span<const BodyRecord>(b, 1)));
}

TEST(Wire, ACountBeyondTheBytesTakesNoMemory) {
  const std::string huge(8, '\xff');
  EXPECT_EQ(unpack_records(huge).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(unpack_round("\x02" + huge).status().code(), absl::StatusCode::kDataLoss);
}

TEST(Wire, UnknownKindsAreRefused) {
  const std::vector<Command> one{RemoveBody{BodyId{1}}};
  std::string bytes = pack(std::span<const Command>(one));
  bytes[8] = static_cast<char>(std::variant_size_v<Command>);
  EXPECT_EQ(unpack_commands(bytes).status().code(), absl::StatusCode::kDataLoss);
}

// Where this fails, what is stored has changed: give each new field since(kStoredVersion + 1, ...), raise
// kStoredVersion, and keep a snapshot of the version before in tests/golden/stored.
TEST(Wire, WhatIsStoredHasAVersion) {
  ASSERT_EQ(kStoredVersion, 8u);
  EXPECT_EQ(stored_layout(), 4674657617521297829u) << stored_outline();
}

// A struct as a version had it, and as the next one has it.
struct Before {
  std::uint32_t number = 0;
  std::string text;
  static void describe(auto& archive, auto& x) { archive(x.number, x.text); }
};
struct After {
  std::uint32_t number = 0;
  double more = 0.5;
  std::vector<std::uint64_t> numbers = {7};
  std::string text;
  static void describe(auto& archive, auto& x) {
    archive(x.number, since(9, x.more), since(9, x.numbers), x.text);
  }
};

TEST(Wire, FieldsThatAVersionDidNotHaveAreTheirDefaults) {
  const std::vector<Before> before = {{3, "three"}, {4, "four"}};
  const std::string bytes = pack_list(std::span<const Before>(before));
  const auto after = unpack_struct<std::vector<After>>(bytes, 8, "structs");
  ASSERT_TRUE(after.ok()) << after.status();
  ASSERT_EQ(after->size(), 2u);
  EXPECT_EQ(after->at(1).number, 4u);
  EXPECT_EQ(after->at(1).text, "four");
  EXPECT_EQ(after->at(1).more, 0.5);
  EXPECT_EQ(after->at(1).numbers, std::vector<std::uint64_t>{7});

  const auto again =
      unpack_struct<std::vector<After>>(pack_list(std::span<const After>(*after)), 9, "structs");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->at(0).text, "three");
  EXPECT_FALSE(unpack_struct<std::vector<After>>(bytes, 9, "structs").ok());
}

TEST(Wire, TheOutlineTellsFieldsAndTheirTypes) {
  EXPECT_EQ(outline_of<After>(), "{u4 f8 list(u8 ) text } ");
  EXPECT_NE(outline_of<Before>(), outline_of<After>());
}

}  // namespace
}  // namespace tessera
