#include "transport/dds_beacon.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>

#include <optional>
#include <tuple>

#include "cluster.h"
#include "dds/dds.h"
#include "transport/dds_domain.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

dds_qos_t* beacon_qos() {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  return qos;
}

// Of two coordinators one stays: the one that is already serving, or else the one that started first.
bool gives_way_to(const tessera_Beacon& mine, const tessera_Beacon& other) {
  return other.serving || std::tie(other.start_ns, other.session) < std::tie(mine.start_ns, mine.session);
}

// The endpoint of a coordinator discovered since the last call to which `mine` gives way.
std::optional<std::string> rival(dds_entity_t reader, const tessera_Beacon& mine) {
  constexpr int kBatch = 16;
  std::optional<std::string> result;
  for (;;) {
    void* samples[kBatch] = {nullptr};
    dds_sample_info_t infos[kBatch];
    const dds_return_t count = dds_take(reader, samples, infos, kBatch, kBatch);
    for (dds_return_t i = 0; i < count; ++i) {
      const auto& other = *static_cast<const tessera_Beacon*>(samples[i]);
      const bool alive = infos[i].valid_data && infos[i].instance_state == DDS_ALIVE_INSTANCE_STATE;
      if (alive && other.session != mine.session && gives_way_to(mine, other)) result = other.endpoint;
    }
    if (count > 0) dds_return_loan(reader, samples, count);
    if (count < kBatch || result) return result;
  }
}

absl::Status look_for_rivals(dds_entity_t participant, dds_entity_t reader, const tessera_Beacon& mine,
                             std::chrono::milliseconds discovery) {
  const dds_entity_t waitset = dds_create_waitset(participant);
  if (waitset < 0) return dds_error(waitset, "cannot wait for other coordinators");
  const absl::Cleanup delete_waitset = [waitset] { dds_delete(waitset); };
  dds_set_status_mask(reader, DDS_DATA_AVAILABLE_STATUS);
  if (const dds_return_t rc = dds_waitset_attach(waitset, reader, 0); rc < 0) {
    return dds_error(rc, "cannot wait for other coordinators");
  }
  const Clock::time_point deadline = Clock::now() + discovery;
  for (;;) {
    if (const std::optional<std::string> endpoint = rival(reader, mine)) {
      return absl::AlreadyExistsError(
          absl::StrCat("cluster ", mine.cluster, " already has a coordinator: ", *endpoint));
    }
    const auto left = std::chrono::nanoseconds(deadline - Clock::now()).count();
    if (left <= 0) return absl::OkStatus();
    dds_attach_t triggered;
    dds_waitset_wait(waitset, &triggered, 1, left);
  }
}

}  // namespace

absl::Status announce_beacon(std::int32_t participant, const BeaconOptions& options) {
  dds_qos_t* qos = beacon_qos();
  const absl::Cleanup delete_qos = [qos] { dds_delete_qos(qos); };
  const std::string name = topic_name(options.cluster, "coordinator");
  const dds_entity_t topic = dds_create_topic(participant, &tessera_Beacon_desc, name.c_str(), qos, nullptr);
  if (topic < 0) return dds_error(topic, "cannot create the coordinator's topic");
  absl::Cleanup delete_topic = [topic] { dds_delete(topic); };
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  if (reader < 0) return dds_error(reader, "cannot listen for other coordinators");
  const absl::Cleanup delete_reader = [reader] { dds_delete(reader); };
  const dds_entity_t writer = dds_create_writer(participant, topic, qos, nullptr);
  if (writer < 0) return dds_error(writer, "cannot announce the coordinator");
  absl::Cleanup delete_writer = [writer] { dds_delete(writer); };

  const auto start_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::system_clock::now().time_since_epoch());
  tessera_Beacon mine{.cluster = const_cast<char*>(options.cluster.c_str()),
                      .node = options.node.value,
                      .session = options.session,
                      .start_ns = static_cast<std::uint64_t>(start_ns.count()),
                      .serving = false,
                      .endpoint = const_cast<char*>(options.endpoint.c_str())};
  if (const dds_return_t rc = dds_write(writer, &mine); rc < 0) return dds_error(rc, "cannot announce");
  if (absl::Status status = look_for_rivals(participant, reader, mine, options.discovery); !status.ok()) {
    return status;
  }
  mine.serving = true;
  if (const dds_return_t rc = dds_write(writer, &mine); rc < 0) return dds_error(rc, "cannot announce");
  std::move(delete_writer).Cancel();
  std::move(delete_topic).Cancel();
  return absl::OkStatus();
}

}  // namespace tessera
