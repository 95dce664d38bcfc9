#include "client_sdk/src/status_json.h"

#include <absl/strings/str_cat.h>

#include <utility>

namespace tessera {
namespace {

using nlohmann::json;

json times(double p50, double p99, double max) { return {{"p50", p50}, {"p99", p99}, {"max", max}}; }

json described(const ServerStatus& server) {
  return {{"node", absl::StrCat(absl::Hex(server.node))},
          {"stream_address", server.stream_address},
          {"engine", name_of(server.precision)},
          {"threads", server.threads},
          {"takes_part", server.takes_part},
          {"suspect", server.suspect},
          {"tick", server.tick},
          {"bodies", server.bodies},
          {"sectors", server.sectors},
          {"sectors_awake", server.sectors_awake},
          {"clones", server.clones},
          {"exchange_bytes", server.exchange_bytes},
          {"peak_rss_bytes", server.peak_rss_bytes},
          {"tick_ms", times(server.tick_ms_p50, server.tick_ms_p99, server.tick_ms_max)}};
}

json described(const WorldSettings& settings) {
  return {{"engine", name_of(settings.precision)},
          {"seams", name_of(settings.seams)},
          {"sector_size", settings.sector_size},
          {"time_step", settings.time_step}};
}

}  // namespace

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
              {"bodies_awake", status.bodies_awake},
              {"bodies_stopped", status.bodies_stopped},
              {"sectors", status.sectors},
              {"clones", status.clones},
              {"contacts", status.contacts},
              {"islands_across_seams", status.islands_across_seams},
              {"islands_shipped", status.islands_shipped},
              {"islands_cut", status.islands_cut},
              {"tick_ms", times(status.tick_ms_p50, status.tick_ms_p99, status.tick_ms_max)},
              {"coordinator_peak_rss_bytes", status.coordinator_peak_rss_bytes},
              {"servers", std::move(servers)}};
  if (status.settings) all["settings"] = described(*status.settings);
  return all;
}

}  // namespace tessera
