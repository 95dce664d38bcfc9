// Triggered publishers in world files, as relays.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "lpss/programs/registry.h"
#include "worlds/gazebo/message_text.h"
#include "worlds/loader/world_text_for_tests.h"

namespace tessera {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

std::string publisher(const std::string& input, const std::string& output, const std::string& more = "") {
  return absl::StrCat("<plugin name='p' filename='gz-sim-triggered-publisher-system'>", input, output, more,
                      "</plugin>");
}

const std::string kCart = model("cart", "<plugin name='v' filename='gz-sim-velocity-control-system'/>");
const std::string kToCart =
    "<output type='gz.msgs.Twist' topic='/model/cart/cmd_vel'>linear: {x: 3, y: -1} angular: {z: "
    "0.5}</output>";

std::string sensor(const std::string& type, const std::string& topic) {
  return absl::StrCat("<sensor name='s' type='", type, "'><topic>", topic, "</topic></sensor>");
}

LoadedWorld with(const std::string& plugin, const std::string& sensors = "") {
  LoadedWorld loaded = load(world(kCart + model("box", "", kUnitBox + sensors) + plugin));
  EXPECT_TRUE(check_programs(loaded.world).ok()) << check_programs(loaded.world);
  return loaded;
}

TEST(MessageText, IsReadAsFields) {
  using gazebo::read_message_text;
  EXPECT_THAT(
      read_message_text(" linear: {x: 3, y:-1.5e2} angular { z: 1 } data: true name: \"a b\"").value(),
      ElementsAre(Pair("linear.x", "3"), Pair("linear.y", "-1.5e2"), Pair("angular.z", "1"),
                  Pair("data", "true"), Pair("name", "a b")));
  EXPECT_THAT(read_message_text(" ").value(), IsEmpty());
  for (const char* wrong : {"x", "x:", "x 3", "{", "}", "x {", "x: {y: 1", "x: 3}", "x: \"a", ": 3", "x: %"})
    EXPECT_FALSE(read_message_text(wrong).ok()) << wrong;
}

// Nothing in the world sends on its topic: clients do.
TEST(TriggeredPublisher, OfATopicOfClientsWaitsToBeTold) {
  const LoadedWorld loaded = with(publisher("<input type='gz.msgs.Empty' topic='/start'/>", kToCart));
  const std::vector<ProgramRecord>& programs = loaded.world.bodies.at(0).programs;
  ASSERT_EQ(programs.size(), 2u);
  const ProgramRecord& relay = programs[1];
  EXPECT_EQ(relay.kind, "relay");
  EXPECT_EQ(relay.name, "start");
  EXPECT_EQ(number_of(relay, "program"), -1);
  EXPECT_EQ(number_of(relay, "body"), 1);
  EXPECT_EQ(number_of(relay, "to_program"), 0);
  EXPECT_EQ(number_of(relay, "count"), 6);
  EXPECT_EQ(number_of(relay, "to_1"), 3);
  EXPECT_EQ(number_of(relay, "to_2"), -1);
  EXPECT_EQ(number_of(relay, "to_6"), 0.5);
  EXPECT_THAT(loaded.notices, Contains(HasSubstr("tessera tell cart::l --program start fire=1")));
}

TEST(TriggeredPublisher, WatchesTheSensorWhoseTopicItHas) {
  const LoadedWorld loaded =
      with(publisher("<input type='gz.msgs.Altimeter' topic='height'><match field='vertical_position' "
                     "tol='0.2'>-7.5</match></input>",
                     kToCart, "<delay_ms>1500</delay_ms>"),
           sensor("altimeter", "/height"));
  const std::vector<ProgramRecord>& programs = loaded.world.bodies.at(1).programs;
  ASSERT_EQ(programs.size(), 2u);
  const ProgramRecord& relay = programs[1];
  EXPECT_EQ(number_of(relay, "program"), 0);
  EXPECT_EQ(number_of(relay, "value"), 0);
  EXPECT_DOUBLE_EQ(number_of(relay, "least"), -7.7);
  EXPECT_DOUBLE_EQ(number_of(relay, "most"), -7.3);
  EXPECT_DOUBLE_EQ(number_of(relay, "delay"), 1.5);
  EXPECT_EQ(number_of(relay, "body"), 1);
  EXPECT_THAT(loaded.notices, Contains("1 x <plugin> triggered publisher is the program relay"));
}

// As the example world of Gazebo has it: a touch lets the crate fall.
TEST(TriggeredPublisher, DetachesAJoint) {
  const std::string detachable =
      "<plugin name='drop' "
      "filename='gz-sim-detachable-joint-system'><parent_link>l</parent_link><child_model>crate"
      "</child_model><child_link>l</child_link><topic>/crate/detach</topic></plugin>";
  const std::string touch =
      "<plugin name='t' "
      "filename='gz-sim-touchplugin-system'><target>box</target><namespace>trigger</namespace>"
      "</plugin>";
  const std::string relay =
      publisher("<input type='gz.msgs.Boolean' topic='/trigger/touched'><match>data: true</match></input>",
                "<output type='gz.msgs.Empty' topic='/crate/detach'/>");
  const LoadedWorld loaded =
      load(world(model("truck", detachable) + model("crate", "") + model("plate", touch + relay)));
  EXPECT_TRUE(check_programs(loaded.world).ok()) << check_programs(loaded.world);
  const std::vector<ProgramRecord>& programs = loaded.world.bodies.at(2).programs;
  ASSERT_EQ(programs.size(), 2u) << "beside what it watches, wherever the plugin is";
  EXPECT_EQ(programs[0].kind, "touch");
  EXPECT_EQ(number_of(programs[1], "least"), 1);
  EXPECT_EQ(number_of(programs[1], "body"), 1);
  EXPECT_EQ(number_of(programs[1], "count"), 1);
  EXPECT_EQ(number_of(programs[1], "to_1"), 1);
}

// A joint to a model that does not move is broken by a program of the other side.
TEST(TriggeredPublisher, DetachesWhatHangsOnAModelThatDoesNotMove) {
  const std::string parts =
      "<static>true</static><plugin name='drop' filename='gz-sim-detachable-joint-system'><parent_link>l"
      "</parent_link><child_model>crate</child_model><child_link>l</child_link></plugin>"
      "<plugin name='t' filename='gz-sim-touchplugin-system'><namespace>gate</namespace></plugin>" +
      publisher("<input type='gz.msgs.Boolean' topic='/gate/touched'><match>data: true</match></input>",
                "<output type='gz.msgs.Empty' topic='/model/gate/detachable_joint/detach'/>");
  const LoadedWorld loaded = load(world(model("gate", parts) + model("crate", "")));
  EXPECT_TRUE(check_programs(loaded.world).ok()) << check_programs(loaded.world);
  ASSERT_EQ(loaded.world.bodies.size(), 3u);
  ASSERT_EQ(loaded.world.bodies[1].programs.size(), 1u);
  EXPECT_EQ(loaded.world.bodies[1].programs[0].kind, "breaker");
  EXPECT_EQ(loaded.world.bodies[2].name, "gate::l::sensors");
  ASSERT_EQ(loaded.world.bodies[2].programs.size(), 2u);
  EXPECT_EQ(number_of(loaded.world.bodies[2].programs[0], "body"), 1);
  EXPECT_EQ(number_of(loaded.world.bodies[2].programs[1], "body"), 2);
}

// A key of a keyboard, of which clients may tell.
TEST(TriggeredPublisher, ThoseThatWaitForDifferentNumbersHaveDifferentNames) {
  const auto key = [](const std::string& number) {
    return publisher("<input type='gz.msgs.Int32' topic='/keyboard/keypress'><match field='data'>" + number +
                         "</match></input>",
                     kToCart);
  };
  const LoadedWorld loaded = with(key("87") + key("88"));
  const std::vector<ProgramRecord>& programs = loaded.world.bodies.at(0).programs;
  ASSERT_EQ(programs.size(), 3u);
  EXPECT_EQ(programs[1].name, "keypress_87");
  EXPECT_EQ(programs[2].name, "keypress_88");
}

// Each triggers the next.
TEST(TriggeredPublisher, TellsOthersOfItsKind) {
  const LoadedWorld loaded = with(publisher("<input type='gz.msgs.Empty' topic='/first'/>",
                                            "<output type='gz.msgs.Empty' topic='/second'/>") +
                                  publisher("<input type='gz.msgs.Empty' topic='/second'/>", kToCart));
  const std::vector<ProgramRecord>& programs = loaded.world.bodies.at(0).programs;
  ASSERT_EQ(programs.size(), 3u);
  EXPECT_EQ(programs[1].name, "second");
  EXPECT_EQ(programs[2].name, "first");
  EXPECT_EQ(number_of(programs[2], "to_program"), 1);
  EXPECT_EQ(number_of(programs[2], "input"), 0);
}

TEST(TriggeredPublisher, SensorsThatStandHaveItsRelays) {
  const LoadedWorld loaded =
      load(world(kCart + model("gate", "<static>true</static>", kUnitBox + sensor("contact", "/gate")) +
                 publisher("<input type='gz.msgs.Contacts' topic='/gate'/>", kToCart)));
  ASSERT_EQ(loaded.world.bodies.size(), 3u);
  ASSERT_EQ(loaded.world.bodies[2].programs.size(), 2u);
  EXPECT_EQ(loaded.world.bodies[2].programs[1].kind, "relay");
  EXPECT_TRUE(check_programs(loaded.world).ok()) << check_programs(loaded.world);
}

TEST(TriggeredPublisher, WhatItCannotDoIsNamed) {
  const std::string input = "<input type='gz.msgs.Empty' topic='/start'/>";
  const std::string of_height = "<input type='gz.msgs.Altimeter' topic='/height'>";
  for (const auto& [plugin, why] : {
           std::pair{publisher(input, "<output type='gz.msgs.Empty' topic='/nobody'/>"),
                     "no program hears nobody"},
           std::pair{publisher(input, ""), "it has no <output>"},
           std::pair{publisher("", kToCart), "it has no <input>"},
           std::pair{publisher(input, "<output type='gz.msgs.Pose' topic='/model/cart/cmd_vel'/>"),
                     "it sends a Pose, which no program hears"},
           std::pair{publisher(input, "<output type='gz.msgs.Empty' topic='/model/cart/cmd_vel'/>"),
                     "a Empty for the program velocity_control"},
           std::pair{publisher(input, kToCart, "<service name='/world/w/set_pose'/>"),
                     "it calls a <service>"},
           std::pair{publisher(input,
                               "<output type='gz.msgs.Twist' topic='/model/cart/cmd_vel'>linear: {x: 1e6}"
                               "</output>"),
                     "x = 1e+06 m/s must be"},
           std::pair{publisher(of_height + "<match field='header'>1</match></input>", kToCart),
                     "the field 'header' of what the program altimeter measures"},
           std::pair{
               publisher(of_height + "<match logic_type='negative' field='x'>1</match></input>", kToCart),
               "its <match> is negative"},
           std::pair{publisher(of_height + "<match>a: 1 b: 2</match></input>", kToCart),
                     "more than one field"},
       }) {
    const LoadedWorld loaded = with(plugin, sensor("altimeter", "/height"));
    EXPECT_THAT(loaded.notices, Contains(HasSubstr(why)));
    EXPECT_EQ(loaded.world.bodies[0].programs.size(), 1u) << why;
  }
}

}  // namespace
}  // namespace tessera
