#include "client_sdk/src/status_json.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "proto/settings_json.h"

namespace tessera {
namespace {

using nlohmann::json;

json described(const ServerStatus& server) {
  json one = {{"node", absl::StrCat(absl::Hex(server.node))},
              {"stream_address", server.stream_address},
              {"engine", name_of(server.precision)},
              {"threads", server.threads},
              {"capacity", server.capacity},
              {"labels", server.labels},
              {"takes_part", server.takes_part},
              {"suspect", server.suspect},
              {"drained", server.drained},
              {"slow", server.slow},
              {"own_ms", server.own_ms},
              {"tick", server.tick},
              {"bodies", server.bodies},
              {"exchange_bytes", server.exchange_bytes},
              {"exchange_messages", server.exchange_messages},
              {"peak_rss_bytes", server.peak_rss_bytes},
              {"tick_ms", to_json(server.tick_ms)}};
  if (server.ground.tiles > 0) {
    one["ground"] = {{"tiles", server.ground.tiles},
                     {"bytes", server.ground.bytes},
                     {"waits", server.ground.waits},
                     {"ticks_waited", server.ground.ticks_waited}};
  }
  for (const TickCounter& counter : kTickCounters) {
    if (counter.over_ticks != OverTicks::kTotal) one[counter.name] = server.counts.*counter.value;
  }
  return one;
}

json described(const CutOff& server) {
  return {{"node", server.node},
          {"stream_address", server.stream_address},
          {"unheard_by", server.unheard_by},
          {"seconds", server.seconds},
          {"tick", server.tick}};
}

}  // namespace

json to_json(const TickTimes& times) {
  return {{"mean", times.mean}, {"p50", times.p50}, {"p99", times.p99}, {"max", times.max}};
}

json to_json(const NamedDivergence& divergence) {
  json one = {{"tick", divergence.tick},
              {"body", divergence.body.value},
              {"body_name", divergence.body_name},
              {"what", name_of(divergence.kind)}};
  if (divergence.joint.value == 0) return one;
  one["joint"] = divergence.joint.value;
  one["joint_name"] = divergence.joint_name;
  return one;
}

json to_json(const ClusterStatus& status) {
  json servers = json::array();
  for (const ServerStatus& server : status.servers) servers.push_back(described(server));
  json all = {{"state", status.state},
              {"failure", status.failure},
              {"world", status.world},
              {"tick", status.tick},
              {"time", status.time},
              {"real_time_factor", status.real_time_factor},
              {"bodies", status.bodies},
              {"recoveries", status.recoveries},
              {"joined_servers", status.joined_servers},
              {"left_servers", status.left_servers},
              {"cut_off_servers", status.cut_off_servers},
              {"moved_sectors", status.moved_sectors},
              {"moved_bodies", status.moved_bodies},
              {"checkpoint_tick", status.checkpoint_tick},
              {"store_failure", status.store_failure},
              {"waits_for_store", status.waits_for_store},
              {"tick_ms", to_json(status.tick_ms)},
              {"coordinator_peak_rss_bytes", status.coordinator_peak_rss_bytes},
              {"servers", std::move(servers)}};
  for (const TickCounter& counter : kTickCounters) {
    const bool is_total = counter.over_ticks == OverTicks::kTotal;
    all[counter.name] = (is_total ? status.counts_since_load : status.counts).*counter.value;
    all["counters"].push_back(counter.name);
  }
  json& cut_off = all["cut_off"] = json::array();
  for (const CutOff& server : status.cut_off) cut_off.push_back(described(server));
  json& divergences = all["divergences"] = json::array();
  for (const NamedDivergence& divergence : status.divergences) divergences.push_back(to_json(divergence));
  json& left_out = all["left_out"] = json::array();
  for (const LeftOutCommands& each : status.left_out)
    left_out.push_back({{"tick", each.tick}, {"commands", each.commands}, {"reason", each.reason}});
  if (status.settings) all["settings"] = to_json(*status.settings);
  return all;
}

}  // namespace tessera
