#include "ros/node.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>

#include "ros_messages.h"
#include "simulation_interfaces.h"
#include "transport/dds_network.h"

namespace tessera::ros {
namespace {

using ::testing::MatchesRegex;

std::string user_data_of(dds_entity_t entity) {
  dds_qos_t* const qos = dds_create_qos();
  EXPECT_EQ(dds_get_qos(entity, qos), DDS_RETCODE_OK);
  void* data = nullptr;
  std::size_t size = 0;
  EXPECT_TRUE(dds_qget_userdata(qos, &data, &size));
  std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  dds_delete_qos(qos);
  return text;
}

// The hashes are those that rosidl has generated for nodes of Jazzy.
TEST(NodeTest, EndpointsSayTheirTypesAsNodesOfJazzyDo) {
  setenv("CYCLONEDDS_URI", dds_configuration({}).c_str(), 1);
  const std::unique_ptr<Node> node = Node::open(static_cast<std::uint32_t>(getpid() % 100)).value();
  EXPECT_EQ(user_data_of(node->writer(sensor_msgs_msg_dds__LaserScan__desc, "/scan").value()),
            "typehash=RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828;");
  EXPECT_EQ(user_data_of(node->writer(sensor_msgs_msg_dds__JointState__desc, "/joint_states").value()),
            "typehash=RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e;");
  EXPECT_EQ(user_data_of(node->reader(geometry_msgs_msg_dds__Vector3__desc, "/vector", [] {}).value()),
            "typehash=RIHS01_cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d;");
  const ServiceEnds ends =
      node->service(simulation_interfaces_srv_dds__StepSimulation_Request__desc,
                    simulation_interfaces_srv_dds__StepSimulation_Response__desc, "/step", [] {})
          .value();
  for (const dds_entity_t end : {ends.requests, ends.replies})
    EXPECT_THAT(user_data_of(end), MatchesRegex("serviceid=[0-9a-f]+\\./step;typehash=RIHS01_[0-9a-f]+;"));
}

}  // namespace
}  // namespace tessera::ros
