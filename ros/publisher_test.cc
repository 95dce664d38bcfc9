#include "ros/publisher.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>

#include "ros/received_for_tests.h"
#include "transport/dds_network.h"

namespace tessera::ros {
namespace {

// As ROS 2 encodes it: little-endian CDR, version 1.
TEST(PublisherTest, MessagesAreThoseOfRosToTheByte) {
  setenv("CYCLONEDDS_URI", dds_configuration({}).c_str(), 1);
  const auto domain = static_cast<std::uint32_t>(getpid() % 100);
  const std::unique_ptr<Node> node = Node::open(domain).value();
  absl::StatusOr<Publisher> publisher = Publisher::open(*node);
  ASSERT_TRUE(publisher.ok()) << publisher.status();
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  const dds_entity_t topic =
      dds_create_topic(participant, &tf2_msgs_msg_dds__TFMessage__desc, "rt/tf_static", nullptr, nullptr);

  Transforms transforms("map", {}, {.sector_size = 128, .time_step = 0.5});
  transforms.name(BodyId{1}, "a::b");
  BodySample body;
  body.id = BodyId{1};
  body.pose.position.local = {1, -2, 0.5};
  ASSERT_TRUE(publisher->publish_static_transforms(transforms.all({5, {body}})).ok());
  EXPECT_EQ(next_message(dds_create_reader(participant, topic, qos, nullptr)),
            absl::StrCat("00010000",                                      // encoding
                         "01000000", "02000000", "0065cd1d",              // 1 transform, 2 s, 5e8 ns
                         "04000000", "6d617000", "04000000", "612f6200",  // "map", "a/b"
                         "00000000",                                      // padding to a multiple of 8
                         "000000000000f03f", "00000000000000c0", "000000000000e03f",  // x y z
                         "0000000000000000", "0000000000000000", "0000000000000000", "000000000000f03f"));
  dds_delete_qos(qos);
  dds_delete(participant);
}

}  // namespace
}  // namespace tessera::ros
