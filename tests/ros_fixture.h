// What a ROS 2 node would be, of plain Cyclone DDS: it reads topics, writes them, and calls services.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>

#include "dds/dds.h"
#include "ros/transforms.h"
#include "tests/cluster_fixture.h"
#include "transport/dds_network.h"

namespace tessera {

class RosTest : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("CYCLONEDDS_URI", dds_configuration({}).c_str(), 1);
    setenv("ROS_DOMAIN_ID", absl::StrCat(domain_).c_str(), 1);
    participant_ = dds_create_participant(domain_, nullptr, nullptr);
    ASSERT_GT(participant_, 0);
  }
  void TearDown() override {
    dds_delete(participant_);
    unsetenv("CYCLONEDDS_URI");
    unsetenv("ROS_DOMAIN_ID");
  }

  dds_entity_t read(const dds_topic_descriptor_t& type, const char* topic, dds_reliability_kind_t reliability,
                    dds_durability_kind_t durability) const {
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, reliability, DDS_SECS(1));
    dds_qset_durability(qos, durability);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 100);
    const dds_entity_t reader = dds_create_reader(
        participant_, dds_create_topic(participant_, &type, topic, nullptr, nullptr), qos, nullptr);
    dds_delete_qos(qos);
    EXPECT_GT(reader, 0);
    return reader;
  }
  dds_entity_t read_clock() const {
    return read(rosgraph_msgs_msg_dds__Clock__desc, "rt/clock", DDS_RELIABILITY_BEST_EFFORT,
                DDS_DURABILITY_VOLATILE);
  }
  dds_entity_t read_transforms() const {
    return read(tf2_msgs_msg_dds__TFMessage__desc, "rt/tf", DDS_RELIABILITY_RELIABLE,
                DDS_DURABILITY_VOLATILE);
  }
  dds_entity_t read_static_transforms() const {
    return read(tf2_msgs_msg_dds__TFMessage__desc, "rt/tf_static", DDS_RELIABILITY_RELIABLE,
                DDS_DURABILITY_TRANSIENT_LOCAL);
  }

  // Whether `see` accepts one of the next messages.
  template <typename Message>
  bool await(dds_entity_t reader, const std::function<bool(const Message&)>& see) const {
    const dds_entity_t waitset = dds_create_waitset(participant_);
    const dds_entity_t condition = dds_create_readcondition(reader, DDS_ANY_STATE);
    dds_waitset_attach(waitset, condition, 0);
    const dds_time_t deadline = dds_time() + absl::ToInt64Nanoseconds(testing::kPatience);
    bool content = false;
    while (!content && dds_waitset_wait_until(waitset, nullptr, 0, deadline) > 0) {
      void* sample = nullptr;
      dds_sample_info_t info;
      if (dds_take(reader, &sample, &info, 1, 1) != 1) continue;
      content = info.valid_data && see(*static_cast<const Message*>(sample));
      dds_return_loan(reader, &sample, 1);
    }
    dds_delete(condition);
    dds_delete(waitset);
    return content;
  }

  dds_entity_t write_to(const dds_topic_descriptor_t& type, const char* topic) const {
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    const dds_entity_t writer = dds_create_writer(
        participant_, dds_create_topic(participant_, &type, topic, nullptr, nullptr), qos, nullptr);
    dds_delete_qos(qos);
    EXPECT_GT(writer, 0);
    return writer;
  }

  // Whether somebody subscribes to what a writer writes, or writes what a reader reads.
  bool await_reader(dds_entity_t writer) const { return await_match(writer, DDS_PUBLICATION_MATCHED_STATUS); }
  bool await_writer(dds_entity_t reader) const {
    return await_match(reader, DDS_SUBSCRIPTION_MATCHED_STATUS);
  }
  bool await_match(dds_entity_t end, std::uint32_t status) const {
    dds_set_status_mask(end, status);
    const dds_entity_t waitset = dds_create_waitset(participant_);
    dds_waitset_attach(waitset, end, 0);
    const bool is_there =
        dds_waitset_wait(waitset, nullptr, 0, absl::ToInt64Nanoseconds(testing::kPatience)) > 0;
    dds_delete(waitset);
    return is_there;
  }

  // Calls a service once it is there; `see` gets the reply to this request.
  template <typename Reply, typename Request>
  void call(const std::string& service, const dds_topic_descriptor_t& request_type,
            const dds_topic_descriptor_t& reply_type, Request request,
            const std::function<void(const Reply&)>& see) {
    const dds_entity_t replies = read(reply_type, ("rr" + service + "Reply").c_str(),
                                      DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_VOLATILE);
    const dds_entity_t requests = write_to(request_type, ("rq" + service + "Request").c_str());
    ASSERT_TRUE(await_reader(requests)) << service;
    request.client = 0x1234;
    request.number = ++calls_;
    ASSERT_EQ(dds_write(requests, &request), 0);
    EXPECT_TRUE(await<Reply>(replies, [&](const Reply& reply) {
      if (reply.client != request.client || reply.number != request.number) return false;
      see(reply);
      return true;
    })) << service;
    dds_delete(requests);
    dds_delete(replies);
  }

  std::int64_t calls_ = 0;
  const std::uint32_t domain_ = static_cast<std::uint32_t>(getpid() % 100);
  dds_entity_t participant_ = 0;
};

}  // namespace tessera
