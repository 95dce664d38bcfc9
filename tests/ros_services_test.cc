// The services of simulation_interfaces, called as a ROS 2 node over Cyclone DDS calls them.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "ros/services.h"
#include "tests/cluster_fixture.h"
#include "tests/ros_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::uint8_t kOk = 1;
constexpr std::uint8_t kPlaying = 1;
constexpr std::uint8_t kPaused = 2;
constexpr char kRobot[] =
    "<sdf version='1.9'><model name='cart'><link name='hull'><inertial><mass>2</mass></inertial><collision "
    "name='c'><geometry><box><size>1 1 1</size></box></geometry></collision></link><link name='mast'><pose>0 "
    "0 1 "
    "0 0 0</pose><collision name='c'><geometry><box><size>0.2 0.2 "
    "1</size></box></geometry></collision></link>"
    "<joint name='j' type='fixed'><parent>hull</parent><child>mast</child></joint></model></sdf>";

char* text(const char* literal) { return const_cast<char*>(literal); }

simulation_interfaces_msg_dds__EntityFilters_ filter(const char* pattern) {
  simulation_interfaces_msg_dds__EntityFilters_ filters{};
  filters.filter = text(pattern);
  return filters;
}

std::vector<std::string> texts_of(const dds_sequence_string& sequence) {
  std::vector<std::string> texts;
  for (std::uint32_t n = 0; n < sequence._length; ++n) texts.emplace_back(sequence._buffer[n]);
  return texts;
}

#define TESSERA_CALL(service, type, request, see)                     \
  call<simulation_interfaces_srv_dds__##type##_Response_>(            \
      service, simulation_interfaces_srv_dds__##type##_Request__desc, \
      simulation_interfaces_srv_dds__##type##_Response__desc, request, see)

class RosServicesTest : public RosTest {
 protected:
  void SetUp() override {
    RosTest::SetUp();
    cluster_ = start_cluster(2);
    ASSERT_TRUE(cluster_.client);
    ASSERT_THAT(client().load(read_world("rover.sdf")).status(), IsOk());
  }
  Client& client() { return *cluster_.client; }
  const std::string& address() { return cluster_.processes->address(); }

  // The code of a service that tells no more.
  template <typename Reply, typename Request>
  std::uint8_t code_of(const char* service, const dds_topic_descriptor_t& request_type,
                       const dds_topic_descriptor_t& reply_type, Request request) {
    std::uint8_t code = 255;
    call<Reply>(service, request_type, reply_type, request, [&](const Reply& reply) {
      code = reply.result.result;
      why_ = reply.result.error_message;
    });
    return code;
  }
  std::uint8_t delete_entity(const char* name) {
    return code_of<simulation_interfaces_srv_dds__DeleteEntity_Response_>(
        "/delete_entity", simulation_interfaces_srv_dds__DeleteEntity_Request__desc,
        simulation_interfaces_srv_dds__DeleteEntity_Response__desc,
        simulation_interfaces_srv_dds__DeleteEntity_Request_{0, 0, text(name)});
  }
  std::uint8_t set_simulation_state(std::uint8_t state) {
    return code_of<simulation_interfaces_srv_dds__SetSimulationState_Response_>(
        "/set_simulation_state", simulation_interfaces_srv_dds__SetSimulationState_Request__desc,
        simulation_interfaces_srv_dds__SetSimulationState_Response__desc,
        simulation_interfaces_srv_dds__SetSimulationState_Request_{0, 0, {state}});
  }
  std::uint8_t step(std::uint64_t steps) {
    return code_of<simulation_interfaces_srv_dds__StepSimulation_Response_>(
        "/step_simulation", simulation_interfaces_srv_dds__StepSimulation_Request__desc,
        simulation_interfaces_srv_dds__StepSimulation_Response__desc,
        simulation_interfaces_srv_dds__StepSimulation_Request_{0, 0, steps});
  }
  std::uint8_t reset(std::uint8_t scope) {
    return code_of<simulation_interfaces_srv_dds__ResetSimulation_Response_>(
        "/reset_simulation", simulation_interfaces_srv_dds__ResetSimulation_Request__desc,
        simulation_interfaces_srv_dds__ResetSimulation_Response__desc,
        simulation_interfaces_srv_dds__ResetSimulation_Request_{0, 0, scope});
  }
  // "code name".
  std::string spawn(const char* name, bool renamed, const char* resource, double x) {
    simulation_interfaces_srv_dds__SpawnEntity_Request_ request{};
    request.name = text(name);
    request.allow_renaming = renamed;
    request.entity_resource = {text(""), text(resource)};
    request.entity_namespace = text("");
    request.initial_pose.header.frame_id = text("");
    request.initial_pose.pose = {{x, 0, 5}, {0, 0, 0, 1}};
    std::string result;
    TESSERA_CALL("/spawn_entity", SpawnEntity, request,
                 [&](const simulation_interfaces_srv_dds__SpawnEntity_Response_& reply) {
                   result = absl::StrCat(reply.result.result, " ", reply.entity_name);
                   why_ = reply.result.error_message;
                 });
    return result;
  }
  std::vector<std::string> entities(const char* pattern) {
    std::vector<std::string> names;
    TESSERA_CALL("/get_entities", GetEntities,
                 (simulation_interfaces_srv_dds__GetEntities_Request_{0, 0, filter(pattern)}),
                 [&](const simulation_interfaces_srv_dds__GetEntities_Response_& reply) {
                   names = texts_of(reply.entities);
                   why_ = reply.result.error_message;
                 });
    return names;
  }
  std::string why_;  // what the last reply said
  Cluster cluster_;
};

TEST_F(RosServicesTest, EntitiesAreFoundPlacedMadeAndRemoved) {
  const Process ros("tessera-ros", {"--connect", address()});
  EXPECT_THAT(entities("^ro"), ElementsAre("robot")) << ros.output();
  EXPECT_THAT(entities("^ro("), ElementsAre());
  EXPECT_THAT(why_, HasSubstr("filter: ")) << "what is wrong with it";

  simulation_interfaces_msg_dds__EntityCategory_ fixed{5};
  auto chosen = filter("");
  chosen.categories = {1, 1, &fixed, false};
  const auto names_of = [&](const simulation_interfaces_msg_dds__EntityFilters_& filters) {
    std::vector<std::string> names;
    TESSERA_CALL("/get_entities", GetEntities,
                 (simulation_interfaces_srv_dds__GetEntities_Request_{0, 0, filters}),
                 [&](const simulation_interfaces_srv_dds__GetEntities_Response_& reply) {
                   EXPECT_EQ(reply.result.result, kOk) << reply.result.error_message;
                   names = texts_of(reply.entities);
                 });
    return names;
  };
  EXPECT_THAT(names_of(chosen), ::testing::Contains("ground"));
  EXPECT_THAT(names_of(chosen), ::testing::Not(::testing::Contains("robot")));
  std::array<geometry_msgs_msg_dds__Vector3_, 2> ball{{{0, 0, 0}, {0.5, 0, 0}}};
  auto within = filter("");
  within.bounds = {3, {2, 2, ball.data(), false}};
  EXPECT_LT(names_of(within).size(), names_of(filter("")).size());

  EXPECT_EQ(spawn("cart_a", false, kRobot, 40), "1 cart_a") << why_;
  EXPECT_EQ(spawn("cart_a", false, kRobot, 44), "101 ");
  EXPECT_EQ(spawn("cart_a", true, kRobot, 44), "1 cart_a_1") << why_;
  EXPECT_EQ(spawn("", false, kRobot, 48), "1 cart") << why_;
  EXPECT_EQ(spawn("x", false, "<sdf version='1.9'><model", 48), "106 ");
  EXPECT_EQ(spawn("x", false, "", 48), "104 ");
  EXPECT_EQ(spawn("a::b", false, kRobot, 52), "102 ");
  EXPECT_THAT(entities("^cart"), ElementsAre("cart", "cart_a", "cart_a_1"));
  EXPECT_EQ(client().find_bodies("cart_a::").value().bodies.size(), 2u);

  EXPECT_EQ(step(1), kOk) << "what is commanded takes effect in the next tick";

  simulation_interfaces_srv_dds__SetEntityState_Request_ moved{};
  moved.entity = text("cart_a");
  moved.state.header.frame_id = text("tessera");
  moved.state.pose = {{60, 1, 7}, {0, 0, 1, 0}};
  moved.state.twist.linear.x = 0.5;
  moved.set_pose = moved.set_twist = true;
  const auto place = [&](std::uint8_t code) {
    TESSERA_CALL("/set_entity_state", SetEntityState, moved,
                 [&](const simulation_interfaces_srv_dds__SetEntityState_Response_& reply) {
                   EXPECT_EQ(reply.result.result, code) << reply.result.error_message;
                 });
  };
  place(kOk);
  EXPECT_EQ(step(1), kOk);
  TESSERA_CALL("/get_entity_state", GetEntityState,
               (simulation_interfaces_srv_dds__GetEntityState_Request_{0, 0, text("cart_a::mast")}),
               [&](const simulation_interfaces_srv_dds__GetEntityState_Response_& reply) {
                 EXPECT_EQ(reply.result.result, kOk) << reply.result.error_message;
                 EXPECT_STREQ(reply.state.header.frame_id, "tessera");
                 EXPECT_NEAR(reply.state.pose.position.x, 60, 0.01);
                 EXPECT_NEAR(reply.state.pose.position.z, 8, 0.01) << "it comes with its hull";
                 EXPECT_NEAR(std::abs(reply.state.pose.orientation.z), 1, 1e-3);
                 EXPECT_NEAR(reply.state.twist.linear.x, 0.5, 1e-3);
               });
  moved.state.pose.orientation.z = 0;
  place(101);
  moved.state.pose.orientation.z = 1;
  moved.state.header.frame_id = text("map");
  place(101);
  moved.state.header.frame_id = text("");
  moved.entity = text("nobody");
  place(2);

  EXPECT_EQ(delete_entity("cart_a"), kOk);
  EXPECT_EQ(delete_entity("cart_a"), 2);
  EXPECT_THAT(why_, HasSubstr("there is no entity \"cart_a\""));
  EXPECT_THAT(entities("^cart"), ElementsAre("cart", "cart_a_1"));
  EXPECT_FALSE(client().find("cart_a::mast").ok());
}

TEST_F(RosServicesTest, TimeIsStoppedSteppedAndBegunAgain) {
  const std::string world = absl::StrCat(TESSERA_OWN_WORLDS, "/rover.sdf");
  const Process ros("tessera-ros", {"--connect", address(), "--world", world});
  EXPECT_EQ(step(5), kOk) << ros.output();
  EXPECT_EQ(client().status().value().tick, 5u);
  EXPECT_EQ(step(0), 4);
  EXPECT_EQ(set_simulation_state(kPaused), 101) << "it is paused already";
  EXPECT_EQ(set_simulation_state(kPlaying), kOk);
  EXPECT_EQ(step(1), 4);
  EXPECT_THAT(why_, HasSubstr("must be paused"));
  EXPECT_EQ(set_simulation_state(3), 0) << "it does not quit";
  EXPECT_EQ(set_simulation_state(kPaused), kOk);
  EXPECT_EQ(reset(1), 0) << "time alone";
  EXPECT_EQ(reset(0), kOk) << why_;
  EXPECT_EQ(client().status().value().tick, 0u);
  EXPECT_EQ(client().status().value().state, "paused");
  TESSERA_CALL("/get_simulation_state", GetSimulationState,
               simulation_interfaces_srv_dds__GetSimulationState_Request_{},
               [&](const simulation_interfaces_srv_dds__GetSimulationState_Response_& reply) {
                 EXPECT_EQ(reply.state.state, kPaused);
               });
  TESSERA_CALL("/get_simulator_features", GetSimulatorFeatures,
               simulation_interfaces_srv_dds__GetSimulatorFeatures_Request_{},
               [&](const simulation_interfaces_srv_dds__GetSimulatorFeatures_Response_& reply) {
                 EXPECT_THAT(texts_of(reply.features.spawn_formats), ElementsAre("sdf", "urdf"));
                 EXPECT_EQ(reply.features.features._length, 15u);
               });
}

}  // namespace
}  // namespace tessera
