// Programs in WebAssembly in a world: the same on any number of partitions and threads, and after a restore;
// what is hostile stops itself alone.
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/programs/module.h"
#include "lpss/simulation/example_programs.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/wasm/test_modules.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr char kImports[] = R"(
  (import "tessera" "parameters" (func $parameters (param i32)))
  (import "tessera" "values" (func $values (param i32)))
  (import "tessera" "set_values" (func $set_values (param i32)))
  (import "tessera" "senses" (func $senses (param i32)))
  (import "tessera" "random" (func $random (param i32) (result f64)))
  (import "tessera" "findings" (func $findings (param i32) (result i32)))
  (import "tessera" "finding" (func $finding (param i32 i32 i32)))
  (import "tessera" "cast" (func $cast (param f64 f64 f64 f64 f64 f64 f64 f64 i32)))
  (import "tessera" "contacts" (func $contacts (param f64)))
  (import "tessera" "body" (func $body (param f64)))
  (import "tessera" "joints" (func $joints))
  (import "tessera" "joint" (func $joint (param f64)))
  (import "tessera" "joint_findings" (func $joint_findings (param i32) (result i32)))
  (import "tessera" "joint_finding" (func $joint_finding (param i32 i32 i32)))
  (import "tessera" "drive" (func $drive (param f64 i32 i32 f64 f64 f64 f64 f64)))
  (import "tessera" "remove_joint" (func $remove_joint (param f64)))
  (import "tessera" "push_awake" (func $push (param f64 f64 f64 f64 f64 f64)))
  (import "tessera" "impulse" (func $impulse (param f64 f64 f64 f64 f64 f64 f64)))
  (import "tessera" "tell" (func $tell (param f64 i32 i32 f64)))
  (import "tessera" "wake_in" (func $wake_in (param i32)))
)";

// Rolls after another body and back to where it started, by turns; and notes what it senses, and whether
// anything is left of earlier calls.
constexpr char kSwarmText[] =
    "program | swarm | Rolls after another.\n"
    "motion | dynamic\n"
    "parameter | after | body | 0 | 0 | 9e15 | Whom.\n"
    "parameter | force | N | 6 | 0 | 100 | With what.\n"
    "input | sign | | 1 | -1 | 1 | Towards or away.\n"
    "value | contacts | | 0 | How many there were.\n"
    "value | far | m | 0 | The sum of all distances.\n"
    "value | left_over | | 0 | Of earlier calls.\n";
constexpr char kSwarm[] = R"(
  (memory 2)
  (global $calls (mut f64) (f64.const 0))
  (func (export "ask")
    (call $parameters (i32.const 0))
    (call $senses (i32.const 64))
    (call $body (f64.load (i32.const 0)))
    (call $contacts (f64.load (i32.const 80)))
    (call $cast (f64.load (i32.const 112)) (f64.load (i32.const 120)) (f64.load (i32.const 128))
      (f64.const 1) (f64.const 0) (f64.const 0) (f64.const 6) (f64.const 0.1) (i32.const -1)))
  (func $towards (param $n i32) (result f64)
    (f64.mul (f64.load (i32.const 8))
      (f64.div (f64.sub (f64.load offset=616 (local.get $n)) (f64.load offset=112 (local.get $n)))
        (f64.add (f64.const 1) (f64.abs (f64.sub (f64.load offset=616 (local.get $n)) (f64.load offset=112 (local.get $n))))))))
  (func $add (param $at i32) (param $more f64)
    (f64.store (local.get $at) (f64.add (f64.load (local.get $at)) (local.get $more))))
  (func (export "run") (local $n i32)
    (call $parameters (i32.const 0))
    (call $senses (i32.const 64))
    (call $values (i32.const 400))
    (call $add (i32.const 416) (f64.add (f64.load (i32.const 130000)) (global.get $calls)))
    (f64.store (i32.const 130000) (f64.const 1))
    (global.set $calls (f64.add (global.get $calls) (f64.const 1)))
    (call $add (i32.const 400) (f64.convert_i32_s (call $findings (i32.const 1))))
    (if (call $findings (i32.const 2))
      (then (call $finding (i32.const 2) (i32.const 0) (i32.const 500))
        (call $add (i32.const 408) (f64.load (i32.const 516)))))
    (if (call $findings (i32.const 0))
      (then (call $finding (i32.const 0) (i32.const 0) (i32.const 512))
        ;; position is 13 numbers from the beginning
        (call $push (call $towards (i32.const 0)) (call $towards (i32.const 8))
          (f64.const 0) (f64.const 0) (f64.const 0) (f64.sub (call $random (i32.const 0)) (f64.const 0.5)))))
    (call $impulse (f64.load (i32.const 0)) (f64.const 0.001) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0))
    (call $tell (f64.load (i32.const 0)) (i32.const 0) (i32.const 0) (f64.sub (call $random (i32.const 1)) (f64.const 0.5)))
    (call $wake_in (i32.const 3))
    (call $set_values (i32.const 400)))
)";

std::string bytes_of(const std::string& code, const std::string& text) {
  return wasm::test_module(absl::StrCat("(module ", kImports, code, ")"), text);
}

std::shared_ptr<const ProgramModule> module_of(const std::string& code, const std::string& text) {
  absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module(bytes_of(code, text));
  EXPECT_TRUE(module.ok()) << module.status();
  return *std::move(module);
}

WorldSettings settings_of(double sector_size) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{{0, 0, -9.81}};
  return settings;
}

BodyDescription& add_ball(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& position) {
  return builder.add(name, builder.shape(Sphere{0.4}), 1, position, Motion::kDynamic);
}

// 24 balls on a floor, each after the next.
WorldDescription swarm_world() {
  WorldBuilder builder(settings_of(8));
  const auto module = module_of(kSwarm, kSwarmText);
  builder.world().settings.modules = {module};
  builder.add_floor(60, 0);
  const std::size_t before = builder.world().bodies.size();
  constexpr std::size_t kBalls = 24;
  for (std::size_t n = 0; n < kBalls; ++n) {
    const double angle = 2 * M_PI * static_cast<double>(n * 5 % kBalls) / kBalls;
    BodyDescription& ball = add_ball(
        builder, "ball" + std::to_string(n),
        {0.3 + (6 + 0.3 * static_cast<double>(n)) * std::cos(angle), 0.2 + 9 * std::sin(angle), 0.5});
    ball.programs.push_back(
        example_program(module->kind, {{"after", static_cast<double>(before + (n + 1) % kBalls + 1)}}));
  }
  return builder.world();
}

using Hashes = std::vector<std::pair<WorldHash, WorldHash>>;

Hashes hashes_of(PartitionCluster& cluster, int ticks) {
  Hashes hashes;
  for (int tick = 0; tick < ticks; ++tick) {
    cluster.step();
    for (Rank rank = 0; rank < cluster.size(); ++rank) check_invariants(cluster.partition(rank));
    hashes.emplace_back(cluster.hash(), cluster.program_hash());
  }
  return hashes;
}

ProgramRecord program_of(const PartitionCluster& cluster, std::size_t body) {
  return cluster.body(BodyId{body + 1})->programs.at(0);
}

TEST(Modules, AreTheSameOnAnyNumberOfPartitionsAndThreads) {
  const WorldDescription world = swarm_world();
  constexpr int kTicks = 300;
  auto cluster = cluster_of(world, 1);
  const Hashes alone = hashes_of(*cluster, kTicks);
  EXPECT_NE(alone.front().second, alone.back().second);
  const std::size_t first = world.bodies.size() - 24;
  for (std::size_t n = first; n < world.bodies.size(); ++n) {
    const ProgramRecord record = program_of(*cluster, n);
    EXPECT_EQ(record.fault, "");
    EXPECT_GT(record.values.at(0), 0) << "it touches the floor";
    EXPECT_EQ(record.values.at(2), 0) << "nothing is left of earlier calls";
  }
  for (const auto& [partitions, threads] : {std::pair{2u, 1}, std::pair{4u, 3}}) {
    const Hashes together = hashes_of(*cluster_of(world, partitions, threads), kTicks);
    const auto [a, b] = std::ranges::mismatch(alone, together);
    EXPECT_TRUE(a == alone.end()) << partitions << " partitions differ at tick " << a - alone.begin() + 1;
  }
  WorldDescription shuffled = world;
  shuffled.settings.shuffle = 1;
  EXPECT_EQ(hashes_of(*cluster_of(shuffled, 3), kTicks), alone);
}

TEST(Modules, GoOnFromASnapshot) {
  const WorldDescription world = swarm_world();
  auto cluster = cluster_of(world, 3);
  hashes_of(*cluster, 150);
  const WorldSnapshot snapshot = cluster->snapshot();
  EXPECT_TRUE(validate(snapshot).ok()) << validate(snapshot);
  EXPECT_EQ(snapshot.settings.modules, world.settings.modules);
  const Hashes expected = hashes_of(*cluster, 100);
  auto restored = PartitionCluster::restore(snapshot, 2);
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(hashes_of(**restored, 100), expected);
}

// Of a world that runs.
TEST(Modules, MayComeWithABodyThatIsSpawned) {
  const auto module = module_of(kSwarm, kSwarmText);
  WorldBuilder builder(settings_of(8));
  builder.add_floor(60, 0);
  add_ball(builder, "hunted", {3.3, 0.2, 0.5});
  const WorldDescription& world = builder.world();
  SpawnBody spawned{records_of(world)->back()};
  const double hunted = static_cast<double>(spawned.record.id.value);
  ++spawned.record.id.value;
  spawned.record.state.position = {0.3, 0.2, 0.5};
  spawned.record.programs = {example_program(module->kind, {{"after", hunted}})};
  const auto hashes_on = [&](std::uint32_t partitions) {
    auto cluster = cluster_of(world, partitions);
    Hashes hashes = hashes_of(*cluster, 10);
    cluster->add_module(module);
    cluster->step(std::vector<Command>{spawned});
    std::ranges::move(hashes_of(*cluster, 60), std::back_inserter(hashes));
    EXPECT_EQ(cluster->snapshot().settings.modules, ProgramModules{module});
    EXPECT_TRUE(validate(cluster->snapshot()).ok());
    EXPECT_GT(program_of(*cluster, world.bodies.size()).values.at(0), 0);
    return hashes;
  };
  EXPECT_EQ(hashes_on(3), hashes_on(1));
}

// What a module does, and how its instance is stopped; empty: it goes on.
struct Hostile {
  std::string name;
  std::string code;
  std::string fault;
};

const std::vector<Hostile>& hostile() {
  static const std::vector<Hostile> kAll = {
      {"loops", R"((func (export "run") (loop $l (br $l))))",
       "it takes more than 1000000 instructions in a call"},
      {"loops_asking", R"((func (export "run")) (func (export "ask") (loop $l (br $l))))",
       "it takes more than 1000000 instructions in a call"},
      {"recurses", R"((func $f (export "run") (call $f)))",
       "its calls take more than 16384 numbers of the stack"},
      {"recurses_wide",
       R"((func $f (param f64) (result f64) (local f64 f64 f64 f64) (f64.add (local.get 4) (call $f (local.get 0)))) (func (export "run") (drop (call $f (f64.const 1)))))",
       "its calls take more than 16384 numbers of the stack"},
      {"traps", R"((func (export "run") unreachable))", "it traps: unreachable executed"},
      {"reads_outside", R"((func (export "run") (drop (f64.load (i32.const 70000)))))",
       "it traps: index out of bounds"},
      {"grows",
       R"((func (export "run") (loop $l (br_if $l (i32.ne (memory.grow (i32.const 1)) (i32.const -1)))) (f64.store (i32.const 2097000) (f64.const 1))))",
       ""},
      {"floods_acts",
       R"((func (export "run") (loop $l (call $push (f64.const 1) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0)) (br $l))))",
       "it acts more than 1024 times in a tick"},
      {"floods_asks",
       R"((func (export "run")) (func (export "ask") (loop $l (call $body (f64.const 1)) (br $l))))",
       "it asks more than 1024 questions, or improper ones"},
      {"asks_improperly",
       R"((func (export "run")) (func (export "ask") (call $cast (f64.const nan) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 9) (f64.const 1e9) (f64.const 0) (i32.const 0))))",
       "it asks more than 1024 questions, or improper ones"},
      {"pushes_hard",
       R"((func (export "run") (call $push (f64.const 1e15) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0))))",
       "push: force = 1e+15 N must be at most 1e+12 N"},
      {"pushes_nan",
       R"((func (export "run") (call $push (f64.const nan) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0))))",
       "push: force x = nan must be finite"},
      {"writes_outside", R"((func (export "run") (call $senses (i32.const -8))))",
       "it hands out a place outside its memory"},
      {"finds_nothing", R"((func (export "run") (call $finding (i32.const 0) (i32.const 3) (i32.const 0))))",
       "it looks at finding 3 of 0"},
      {"asks_in_run", R"((func (export "run") (call $body (f64.const 1))))",
       "questions can be asked in ask() alone"},
      {"acts_in_ask", R"((func (export "run")) (func (export "ask") (call $wake_in (i32.const 1))))",
       "acts belong into run()"},
      {"tells_nobody",
       R"((func (export "run") (call $tell (f64.const 0.5) (i32.const 0) (i32.const 0) (f64.const 0))))",
       "tell: body = 0.5 must be the id of a body"},
      {"asks_for_half_a_joint",
       R"((func (export "run")) (func (export "ask") (call $joint (f64.const 0.5))))",
       "joint = 0.5 must be the id of a joint"},
      {"drives_nothing",
       R"((func (export "run") (call $drive (f64.const 7) (i32.const 0) (i32.const 3) (f64.const 1) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0))))",
       "drive: joint = 7 must be one that was asked for and is there"},
      {"finds_no_joint",
       R"((func (export "run") (call $joint_finding (i32.const 0) (i32.const 0) (i32.const 0))) (func (export "ask") (call $joints)))",
       "it looks at joint 0 of 0"},
      {"keeps_nan",
       R"((func (export "run") (f64.store (i32.const 0) (f64.const nan)) (call $set_values (i32.const 0))))",
       "a value is not finite"},
  };
  return kAll;
}

// In several worlds, since one has at most 16 modules.
TEST(Modules, ThatAreHostileStopThemselvesAlone) {
  for (std::size_t begin = 0; begin < hostile().size(); begin += 11) {
    WorldBuilder builder(settings_of(8));
    builder.add_floor(60, 0);
    const auto swarm = module_of(kSwarm, kSwarmText);
    builder.world().settings.modules = {swarm};
    const std::size_t good = builder.world().bodies.size();
    add_ball(builder, "good", {0.3, 0.2, 0.5})
        .programs.push_back(example_program(swarm->kind, {{"after", static_cast<double>(good + 2)}}));
    const std::size_t end = std::min(begin + 11, hostile().size());
    for (std::size_t n = begin; n < end; ++n) {
      const auto module = module_of(
          "(memory 1) " + hostile()[n].code,
          absl::StrCat("program | ", hostile()[n].name, " | Harms.\nvalue | x | | 0 | A number.\n"));
      builder.world().settings.modules.push_back(module);
      add_ball(builder, hostile()[n].name, {3.0 * static_cast<double>(n - begin) - 10, 4, 0.5})
          .programs.push_back(example_program(module->kind));
    }
    const WorldDescription& world = builder.world();
    auto cluster = cluster_of(world, 1);
    const Hashes alone = hashes_of(*cluster, 60);
    EXPECT_EQ(program_of(*cluster, good).fault, "");
    EXPECT_GT(program_of(*cluster, good).values.at(0), 20);
    for (std::size_t n = begin; n < end; ++n) {
      const std::string& fault = hostile()[n].fault;
      EXPECT_EQ(program_of(*cluster, good + 1 + n - begin).fault, fault.empty() ? "" : "tick 1: " + fault)
          << hostile()[n].name;
    }
    EXPECT_TRUE(validate(cluster->snapshot()).ok());
    EXPECT_EQ(hashes_of(*cluster_of(world, 3), 60), alone);
  }
}

// The terms of pid that it drives a joint with.
constexpr char kPdText[] =
    "program | pd | Drives a joint.\n"
    "parameter | joint | joint | 0 | 0 | 9e15 | Which.\n"
    "parameter | p | | 0 | 0 | 1e6 | By the error.\n"
    "parameter | d | | 0 | 0 | 1e6 | By the rate.\n"
    "parameter | set_point | | 0 | -10 | 10 | Where to.\n";
constexpr char kPd[] = R"(
  (memory 1)
  (func (export "ask")
    (call $parameters (i32.const 0))
    (call $joint (f64.load (i32.const 0))))
  (func (export "run")
    (call $parameters (i32.const 0))
    (if (call $joint_findings (i32.const 0))
      (then (call $joint_finding (i32.const 0) (i32.const 0) (i32.const 64))
        ;; the position is 5 numbers from the beginning, the rate 7
        (call $drive (f64.load (i32.const 64)) (i32.const 0) (i32.const 3)
          (f64.sub
            (f64.mul (f64.load (i32.const 8)) (f64.sub (f64.load (i32.const 24)) (f64.load (i32.const 104))))
            (f64.mul (f64.load (i32.const 16)) (f64.load (i32.const 120))))
          (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0)))))
)";

// An arm that falls from its side and is lifted, on a border of sectors.
WorldDescription arm_world(const ProgramRecord& program, const ProgramModules& modules) {
  WorldBuilder builder(settings_of(1));
  builder.world().settings.modules = modules;
  BodyDescription& arm =
      builder.add("arm", builder.shape(Box{{0.4, 0.05, 0.05}}), 2, {0.9, 0.2, 0.2}, Motion::kDynamic);
  arm.programs = {program};
  builder.tie("hinge", JointType::kRevolute, "", "arm", {0.5, 0.2, 0.2}, Eigen::Vector3d::UnitY());
  JointAxis& axis = builder.world().joints.back().properties.axes[0];
  axis.lower = -2;
  axis.upper = 2;
  return builder.world();
}

TEST(Modules, DriveAJointWithTheBitsOfABuiltInProgram) {
  const ProgramNumbers numbers = {{"joint", 1}, {"p", 40}, {"d", 4}, {"set_point", -0.7}};
  const auto module = module_of(kPd, kPdText);
  constexpr int kTicks = 240;
  const auto world_hashes = [](const WorldDescription& world, std::uint32_t partitions) {
    std::vector<WorldHash> hashes;
    for (const auto& [world_hash, _] : hashes_of(*cluster_of(world, partitions), kTicks))
      hashes.push_back(world_hash);
    return hashes;
  };
  const std::vector<WorldHash> built_in = world_hashes(arm_world(example_program("pid", numbers), {}), 1);
  for (const std::uint32_t partitions : {1u, 3u})
    EXPECT_EQ(world_hashes(arm_world(example_program(module->kind, numbers), {module}), partitions),
              built_in);
}

// Both axes, one after the other; then what the joint has not.
constexpr char kGimbal[] = R"(
  (memory 1)
  (func (export "ask") (call $joints))
  (func (export "run")
    (call $parameters (i32.const 0))
    (call $joint_finding (i32.const 0) (i32.const 0) (i32.const 64))
    (call $drive (f64.load (i32.const 64)) (i32.const 0) (i32.const 2) (f64.const 0.3) (f64.const 0) (f64.const 0)
      (f64.const 0) (f64.const 0))
    (call $drive (f64.load (i32.const 64)) (i32.trunc_f64_s (f64.load (i32.const 0)))
      (i32.trunc_f64_s (f64.load (i32.const 8))) (f64.const -0.4) (f64.const 0) (f64.const 0) (f64.const 0) (f64.const 0))
    (call $set_values (i32.const 64)))
)";
constexpr char kGimbalText[] =
    "program | gimbal | Drives two axes.\n"
    "parameter | axis | | 1 | 0 | 9 | The second one.\n"
    "parameter | mode | | 2 | 0 | 9 | Of its drive.\n"
    "value | joint | joint | 0 | Which.\n"
    "value | type | | 0 | Of the joint.\n"
    "value | parent | body | 0 | Of the joint.\n"
    "value | child | body | 0 | Of the joint.\n"
    "value | axes | | 0 | Of the joint.\n"
    "value | position | rad | 0 | Of the first axis.\n"
    "value | second | rad | 0 | Of the second axis.\n";

TEST(Modules, DriveBothAxesOfAJoint) {
  const auto module = module_of(kGimbal, kGimbalText);
  const auto record_after = [&](const ProgramNumbers& numbers) {
    WorldBuilder builder(settings_of(1));
    builder.world().settings.modules = {module};
    BodyDescription& head =
        builder.add("head", builder.shape(Box{{0.2, 0.1, 0.1}}), 1, {0.6, 0.2, 0.2}, Motion::kDynamic);
    head.programs = {example_program(module->kind, numbers)};
    builder.tie("gimbal", JointType::kUniversal, "", "head", {0.6, 0.2, 0.2});
    auto cluster = cluster_of(builder.world(), 2);
    hashes_of(*cluster, 60);
    return program_of(*cluster, builder.world().bodies.size() - 1);
  };
  const ProgramRecord both = record_after({});
  EXPECT_EQ(both.fault, "");
  ASSERT_EQ(both.values.size(), 7u);
  EXPECT_EQ(both.values[0], 1);
  EXPECT_EQ(both.values[1], static_cast<double>(JointType::kUniversal));
  EXPECT_EQ(both.values[2], 0) << "the world";
  EXPECT_EQ(both.values[4], 2);
  EXPECT_NEAR(both.values[5], 0.3, 1e-4);
  EXPECT_NEAR(both.values[6], -0.4, 1e-4);
  EXPECT_EQ(record_after({{"axis", 2}}).fault,
            "tick 1: drive: axis = 2 must be below 2, the axes of joint 1");
  EXPECT_EQ(record_after({{"mode", 7}}).fault, "tick 1: drive: mode = 7 must be at most 4");
}

// Of a chain of three, the second link lets go of the third; a joint that is not its own, it cannot remove.
TEST(Modules, RemoveJointsOfTheirBodyAlone) {
  constexpr char kText[] =
      "program | cutter | Cuts a joint.\nmotion | dynamic\nparameter | joint | joint | 0 | 0 | 9e15 | "
      "Which.\n";
  constexpr char kCutter[] = R"(
    (memory 1)
    (func (export "ask") (call $parameters (i32.const 0)) (call $joint (f64.load (i32.const 0))))
    (func (export "run")
      (call $parameters (i32.const 0))
      (if (call $joint_findings (i32.const 0)) (then (call $remove_joint (f64.load (i32.const 0))))))
  )";
  for (const std::uint32_t partitions : {1u, 3u}) {
    for (const std::uint64_t joint : {3u, 1u}) {
      WorldBuilder builder(settings_of(1));
      builder.add_chain(3, {0.3, 0.2, 1.4}, -Eigen::Vector3d::UnitZ());
      const auto module = module_of(kCutter, kText);
      builder.world().settings.modules = {module};
      ProgramRecord cutter = *new_program(module->kind);
      ASSERT_TRUE(set_number(cutter, "joint", static_cast<double>(joint)).ok());
      builder.world().bodies[1].programs = {cutter};
      const auto cluster = cluster_of(builder.world(), partitions);
      for (int tick = 0; tick < 5; ++tick) cluster->step();
      bool is_there = false;
      for (Rank rank = 0; rank < cluster->size(); ++rank)
        is_there = is_there || cluster->partition(rank).joints.find(JointId{joint}) != nullptr;
      EXPECT_EQ(is_there, joint == 1);
      EXPECT_THAT(cluster->body(BodyId{2})->programs[0].fault,
                  joint == 1 ? HasSubstr("remove_joint: joint = 1 must be one of its body") : HasSubstr(""));
    }
  }
}

TEST(Modules, AreKnownWhileAWorldHasThem) {
  std::string kind;
  {
    const auto module = module_of(kSwarm, kSwarmText);
    kind = module->kind;
    EXPECT_THAT(kind, StartsWith("swarm@"));
    EXPECT_EQ(module_of(kSwarm, kSwarmText), module) << "it is read once";
    ASSERT_NE(find_program(kind), nullptr);
    EXPECT_EQ(find_program("swarm"), find_program(kind));
    EXPECT_EQ(find_program(kind)->parameters().size(), 2u);
    EXPECT_EQ(new_program("swarm")->kind, kind);
    const auto other = module_of(std::string(kSwarm) + "(func)", kSwarmText);
    EXPECT_NE(other->kind, kind);
    EXPECT_EQ(find_program("swarm"), nullptr) << "two have this name";
  }
  EXPECT_EQ(find_program(kind), nullptr);
  EXPECT_THAT(new_program(kind).status().message(), HasSubstr("no world here has its module"));
}

TEST(Modules, AreRefusedWhereTheWorldDoesNotHaveThem) {
  WorldDescription world = swarm_world();
  const ProgramModules modules = std::exchange(world.settings.modules, {});
  EXPECT_THAT(PartitionCluster::create(world, 1).status().message(),
              HasSubstr("the world does not have its module"));
  world.settings.modules = {modules[0], modules[0]};
  EXPECT_THAT(PartitionCluster::create(world, 1).status().message(), HasSubstr("is given twice"));
}

TEST(Modules, AreRefusedWhereTheirDescriptionIsWrong) {
  const auto said = [](const std::string& text) {
    return std::string(load_module(bytes_of("(memory 1) (func (export \"run\"))", text)).status().message());
  };
  EXPECT_EQ(said("program | a | b\n"), "");
  EXPECT_EQ(said("value | a | | 0 | b\n"), "description: a line must begin with 'program |'");
  EXPECT_THAT(said("program | A | b\n"), HasSubstr("description, line 1: the name 'A' must be"));
  EXPECT_THAT(said("program | a | b\nparameter | x | m | 5 | 0 | 1 | c\n"),
              HasSubstr("line 2: x = 5 must be at most 1"));
  EXPECT_THAT(said("program | a | b\nparameter | x | m | 5 | 0 | c\n"),
              HasSubstr("line 2: it has 6 fields, and must be"));
  EXPECT_THAT(said("program | a | b\ninput | x | m | 0 | 0 | 1 | c\nparameter | x | | 0 | 0 | 1 | c\n"),
              HasSubstr("line 3: the name 'x' is given twice"));
  EXPECT_THAT(said("program | a | b\nmotion | static\n"), HasSubstr("'static' must be dynamic or kinematic"));
  EXPECT_THAT(said("clock\n"),
              HasSubstr("line 1: 'clock' must be program, motion, parameter, input or value"));
}

}  // namespace
}  // namespace tessera
