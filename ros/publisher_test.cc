#include "ros/publisher.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>

#include "dds/dds.h"
#include "dds/ddsi/ddsi_serdata.h"
#include "transport/dds_network.h"

namespace tessera::ros {
namespace {

// The next message of a topic as received, in hexadecimal digits.
std::string next_message(dds_entity_t reader) {
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  const dds_entity_t participant = dds_get_participant(reader);
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, reader, 0);
  dds_waitset_wait(waitset, nullptr, 0, DDS_SECS(60));
  dds_delete(waitset);
  ddsi_serdata* message = nullptr;
  dds_sample_info_t info;
  if (dds_takecdr(reader, &message, 1, &info, DDS_ANY_STATE) != 1) return "";
  std::string bytes(ddsi_serdata_size(message), '\0');
  ddsi_serdata_to_ser(message, 0, bytes.size(), bytes.data());
  ddsi_serdata_unref(message);
  return absl::BytesToHexString(bytes);
}

// As ROS 2 encodes it: little-endian CDR, version 1.
TEST(PublisherTest, MessagesAreThoseOfRosToTheByte) {
  setenv("CYCLONEDDS_URI", dds_configuration({}).c_str(), 1);
  const auto domain = static_cast<std::uint32_t>(getpid() % 100);
  const std::unique_ptr<Publisher> publisher = Publisher::open(domain).value();
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
