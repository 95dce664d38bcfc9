// Programs of links in world files.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

#include "lpss/programs/registry.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::HasSubstr;

const std::string kProgrammedBox = collision("<box><size>1 1 1</size></box>");

std::string world_with_program(const std::string& program, const std::string& more = "") {
  return world(model("m", "", kProgrammedBox + more + program) + model("other", "", kProgrammedBox));
}

std::string error_of_program(const std::string& text) {
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(text, "/");
  EXPECT_FALSE(loaded.ok());
  return std::string(loaded.status().message());
}

TEST(ProgramsOfFiles, AreReadWithTheirNumbersInTheirOrder) {
  const LoadedWorld loaded =
      load(world_with_program("<tessera:program kind='character' name='legs' step='0.25' x='1.5'/>"
                              "<tessera:program kind='wander' radius='3'/>"));
  const std::vector<ProgramRecord>& programs = loaded.world.bodies.at(0).programs;
  ASSERT_EQ(programs.size(), 2u);
  EXPECT_EQ(programs[0].kind, "character");
  EXPECT_EQ(programs[0].name, "legs");
  EXPECT_EQ(number_of(programs[0], "step"), 0.25);
  EXPECT_EQ(number_of(programs[0], "height"), 1) << "what is not named is as at first";
  EXPECT_EQ(programs[0].inputs.at(0), 1.5);
  EXPECT_EQ(programs[1].kind, "wander");
  EXPECT_EQ(number_of(programs[1], "radius"), 3);
  EXPECT_TRUE(check_programs(loaded.world).ok());
}

TEST(ProgramsOfFiles, NameBodies) {
  const LoadedWorld loaded = load(
      world_with_program("<tessera:program kind='pad' body='other::l'/>", "<kinematic>true</kinematic>"));
  EXPECT_EQ(number_of(loaded.world.bodies.at(0).programs.at(0), "body"), 2);
  EXPECT_THAT(error_of_program(world_with_program("<tessera:program kind='pad' body='nobody::l'/>")),
              HasSubstr("names the body 'nobody::l', which is not there"));
}

TEST(ProgramsOfFiles, NameProgramsInputsAndValues) {
  const auto with = [](const std::string& program) {
    return world(model("m", "", kProgrammedBox + "<tessera:program kind='touch'/>" + program) +
                 model("other", "",
                       kProgrammedBox + "<tessera:program kind='pose'/>" +
                           "<tessera:program kind='velocity_control' name='legs'/>"));
  };
  const LoadedWorld loaded =
      load(with("<tessera:program kind='relay' program='touch' value='force' least='9' body='other::l' "
                "to_program='legs' input='y' to_1='2'/>"));
  const ProgramRecord& relay = loaded.world.bodies.at(0).programs.at(1);
  EXPECT_EQ(number_of(relay, "program"), 0);
  EXPECT_EQ(number_of(relay, "value"), 2);
  EXPECT_EQ(number_of(relay, "body"), 2);
  EXPECT_EQ(number_of(relay, "to_program"), 1);
  EXPECT_EQ(number_of(relay, "input"), 1);
  const LoadedWorld by_place = load(with("<tessera:program kind='relay' program='0' value='3'/>"));
  EXPECT_EQ(number_of(by_place.world.bodies.at(0).programs.at(1), "value"), 3);
  for (const auto& [numbers, error] :
       {std::pair{"program='smell'", "names the program 'smell', which is not there"},
        std::pair{"program='touch' value='smell'",
                  "names the value 'smell', which program touch does not have"},
        std::pair{"to_program='legs'", "names the program 'legs', but no body that has it"},
        std::pair{"value='force'", "names the value 'force', but no program that has it"}}) {
    EXPECT_THAT(error_of_program(with(absl::StrCat("<tessera:program kind='relay' ", numbers, "/>"))),
                HasSubstr(error));
  }
}

TEST(ProgramsOfFiles, NameJointsOfTheirOwnModelFirst) {
  const auto arm = [](const std::string& name, const std::string& joint) {
    return "<model name='" + name + "'><link name='base'>" + kProgrammedBox +
           "<tessera:program kind='pid' joint='" + joint + "'/></link><link name='tip'>" + kProgrammedBox +
           "</link><joint name='elbow' type='revolute'><parent>base</parent><child>tip</child><axis><xyz>0 0 "
           "1</xyz>"
           "</axis></joint></model>";
  };
  const LoadedWorld loaded = load(world(arm("a", "elbow") + arm("b", "elbow") + arm("c", "a::elbow")));
  ASSERT_EQ(loaded.world.joints.size(), 3u);
  for (const auto& [body, joint] : {std::pair(0, 1), std::pair(2, 2), std::pair(4, 1)}) {
    EXPECT_EQ(number_of(loaded.world.bodies.at(static_cast<std::size_t>(body)).programs.at(0), "joint"),
              joint);
  }
  EXPECT_TRUE(check_programs(loaded.world).ok());
  EXPECT_THAT(error_of_program(world(arm("a", "wrist"))),
              HasSubstr("names the joint 'wrist', which is not there"));
}

TEST(ProgramsOfFiles, SayWhatIsWrong) {
  EXPECT_THAT(error_of_program(world_with_program("<tessera:program kind='walker'/>")),
              HasSubstr("there is no program \"walker\"; there are: ackermann, altimeter"));
  EXPECT_THAT(error_of_program(world_with_program("<tessera:program step='1'/>")), HasSubstr("kind"));
  EXPECT_THAT(error_of_program(world_with_program("<tessera:program kind='mover' spead='1'/>")),
              HasSubstr("program mover has no number 'spead'; it has: x, y, z, speed"));
  EXPECT_THAT(error_of_program(world_with_program("<tessera:program kind='mover' speed='-1'/>")),
              HasSubstr("speed = -1 m/s must be at least 1e-06 m/s"));
  std::string nine;
  for (int n = 0; n < 9; ++n) nine += "<tessera:program kind='wander'/>";
  EXPECT_THAT(error_of_program(world_with_program(nine)), HasSubstr("at most 8 programs"));
}

TEST(ProgramsOfFiles, AreInModules) {
  const std::filesystem::path folder = std::filesystem::path(TESSERA_SOURCE_WORLDS) / "programs";
  const std::string text = world_with_program(
      "<tessera:program module='flee.wasm' from='other::l' radius='3'/><tessera:program "
      "module='flee.wasm'/>");
  const absl::StatusOr<LoadedWorld> loaded = load_world_string(text, folder);
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ(loaded->world.settings.modules.size(), 1u) << "one file is one module";
  const std::string kind = loaded->world.settings.modules[0]->kind;
  EXPECT_THAT(kind, testing::StartsWith("flee@"));
  const std::vector<ProgramRecord>& programs = loaded->world.bodies.at(0).programs;
  ASSERT_EQ(programs.size(), 2u);
  EXPECT_EQ(programs[0].kind, kind);
  EXPECT_EQ(number_of(programs[0], "from"), 2);
  EXPECT_EQ(number_of(programs[0], "radius"), 3);
  EXPECT_EQ(number_of(programs[1], "radius"), 8);
  EXPECT_TRUE(check_programs(loaded->world).ok()) << check_programs(loaded->world);
}

TEST(ProgramsOfFiles, SayWhatIsWrongWithModules) {
  const Folder folder;
  std::ifstream from(std::filesystem::path(TESSERA_SOURCE_WORLDS) / "programs/flee.wasm", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(from)), {});
  bytes.at(bytes.find("parameters")) = 'P';
  folder.write("bad.wasm", bytes);
  const auto error = [&](const std::string& attributes) {
    return std::string(load_world_string(world_with_program("<tessera:program " + attributes + "/>"), folder)
                           .status()
                           .message());
  };
  EXPECT_THAT(
      error("module='bad.wasm'"),
      HasSubstr("bad.wasm: byte 78: import section: import \"Parameters\" of \"tessera\" is unknown"));
  EXPECT_THAT(error("module='none.wasm'"), HasSubstr("none.wasm"));
  EXPECT_THAT(error("module='bad.wasm' kind='mover'"), HasSubstr("not both"));
}

}  // namespace
}  // namespace tessera
