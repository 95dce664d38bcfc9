#include "simulator/any_message.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "coordinator/asked_queries.h"
#include "coordinator/command_list.h"
#include "lpss/model/world_records.h"
#include "lpss/programs/module.h"
#include "lpss/programs/registry.h"
#include "lpss/simulation/example_programs.h"
#include "lpss/wasm/test_modules.h"
#include "simulator/late_module.h"
#include "simulator/scenario.h"

namespace tessera {
namespace {

class AnyMessages : public ::testing::Test {
 protected:
  AnyMessages() {
    known_.settings = world_.settings;
    for (std::size_t n = 0; n < world_.bodies.size(); ++n) {
      const BodyDescription& body = world_.bodies[n];
      const bool is_static = body.properties.motion == Motion::kStatic;
      known_.bodies.push_back({n + 1, body.name, is_static ? v1::MOTION_STATIC : v1::MOTION_DYNAMIC});
      known_.places.push_back(body.pose.position);
    }
  }

  WorldRegistry registry() const { return {world_, *records_of(world_), *joint_records_of(world_)}; }
  static int kinds_of(const google::protobuf::Descriptor& message) {
    return message.oneof_decl(0)->field_count();
  }

  const WorldDescription world_ = corner_pile();
  KnownWorld known_;
};

TEST_F(AnyMessages, EveryKindIsDrawn) {
  Dice dice(1, 1);
  AnyMessage message(dice, known_, true);
  std::set<int> commands;
  std::set<int> queries;
  for (int n = 0; n < 2000; ++n) {
    commands.insert(message.command().kind_case());
    queries.insert(message.query().kind_case());
  }
  EXPECT_EQ(commands.size(), kinds_of(*v1::Command::descriptor()));
  EXPECT_EQ(queries.size(), kinds_of(*v1::Query::descriptor()));
}

// Of programs that are built in, of modules of the world, and of one that it gets.
TEST_F(AnyMessages, EveryProgramIsDrawnAndMostAreTaken) {
  const auto module = load_module(wasm::test_module(R"((module (memory 1) (func (export "run"))))"));
  ASSERT_TRUE(module.ok()) << module.status();
  WorldSettings settings = world_.settings;
  settings.modules = {*module};
  const WorldDescription crowd = crowd_world(settings);
  known_.settings = settings;
  known_.bodies.clear();
  for (std::size_t n = 0; n < crowd.bodies.size(); ++n) {
    known_.bodies.push_back({n + 1, crowd.bodies[n].name, v1::MOTION_DYNAMIC});
    if (!crowd.bodies[n].programs.empty())
      known_.programs.push_back({n + 1, 0, crowd.bodies[n].programs[0].kind});
  }
  std::set<std::string> drawn;
  int tells = 0;
  int taken = 0;
  for (std::uint32_t seed = 0; seed < 10'000; ++seed) {
    Dice dice(seed, 1);
    google::protobuf::RepeatedPtrField<v1::Command> list;
    *list.Add() = AnyMessage(dice, known_, true).command();
    for (const v1::Body& body : list[0].spawn().model().bodies()) {
      for (const v1::Program& program : body.programs()) drawn.insert(program.kind());
    }
    if (!list[0].has_tell_program()) continue;
    WorldRegistry registry(crowd, *records_of(crowd), *joint_records_of(crowd));
    ++tells;
    if (give(list, registry, 1).ok()) ++taken;
  }
  std::set<std::string> all = {(*module)->kind, late_module()->kind};
  for (const Program* program : programs()) all.emplace(program->kind());
  EXPECT_EQ(drawn, all);
  EXPECT_GT(taken, tells * 9 / 10) << taken << " of " << tells;
}

// Most of what is to be valid is taken, and some of each kind, where the world has what it needs.
TEST_F(AnyMessages, MostAreTaken) {
  std::map<int, int> drawn;
  std::map<int, int> taken;
  for (std::uint32_t seed = 0; seed < 3000; ++seed) {
    Dice dice(seed, 1);
    WorldRegistry registry = this->registry();
    google::protobuf::RepeatedPtrField<v1::Command> list;
    *list.Add() = AnyMessage(dice, known_, true).command();
    ++drawn[list[0].kind_case()];
    if (give(list, registry, 1).ok()) ++taken[list[0].kind_case()];
  }
  const std::set<int> need_joints_or_others = {v1::Command::kRemoveJoint,        v1::Command::kSetJointDrives,
                                               v1::Command::kDriveJoints,        v1::Command::kSetState,
                                               v1::Command::kSetKinematicTarget, v1::Command::kTellProgram};
  for (const auto& [kind, count] : drawn) {
    if (need_joints_or_others.contains(kind)) continue;
    EXPECT_GT(taken[kind], count / 3) << v1::Command::descriptor()->FindFieldByNumber(kind)->name() << ": "
                                      << taken[kind] << " of " << count;
  }
}

TEST_F(AnyMessages, MostQueriesAreTaken) {
  int taken = 0;
  constexpr int kDraws = 1000;
  for (std::uint32_t seed = 0; seed < kDraws; ++seed) {
    Dice dice(seed, 1);
    google::protobuf::RepeatedPtrField<v1::Query> list;
    *list.Add() = AnyMessage(dice, known_, true).query();
    if (AskedQueries::checked(list, registry()).ok()) ++taken;
  }
  EXPECT_GT(taken, kDraws / 2);
}

TEST(AnyNumbers, KeepToTheirRangeUnlessTheyNeedNot) {
  bool is_outside = false;
  for (std::uint32_t seed = 0; seed < 2000; ++seed) {
    Dice dice(seed, 1);
    const double valid = AnyNumber(dice, true).within({-2, 1e6});
    EXPECT_TRUE(valid >= -2 && valid <= 1e6) << valid;
    const double any = AnyNumber(dice, false).within({-2, 1e6});
    is_outside |= !(any >= -2 && any <= 1e6);
  }
  EXPECT_TRUE(is_outside);
}

}  // namespace
}  // namespace tessera
