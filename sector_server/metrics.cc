#include "sector_server/metrics.h"

#include <absl/strings/str_format.h>

#include "daemon/metric_families.h"
#include "proto/convert_counts.h"

namespace tessera {
namespace {

// s; a tick of 60 Hz has 0.0167.
const prometheus::Histogram::BucketBoundaries kTickBuckets = {
    0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.0167, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5};

}  // namespace

ServerMetrics::ServerMetrics(const SectorServerArguments& arguments)
    : joined_(gauge("tessera_server_joined", "1 while this server belongs to a coordinator's cluster")),
      tick_(gauge("tessera_server_tick", "Tick of the loaded world that this server has completed")),
      ticks_(counter("tessera_server_ticks_total", "Ticks completed by this process")),
      tick_duration_(prometheus::BuildHistogram()
                         .Name("tessera_server_tick_duration_seconds")
                         .Help("Duration of ticks, including waiting for other servers, without pacing")
                         .Register(registry_)
                         .Add({}, kTickBuckets)),
      own_time_(counter("tessera_server_own_seconds_total",
                        "Duration of ticks, without waiting for other servers")),
      bodies_(gauge("tessera_server_bodies", "Movable bodies on this server")),
      exchange_(counter("tessera_server_exchange_bytes_total", "Bytes sent to other sector servers")),
      ground_tiles_(gauge("tessera_server_ground_tiles", "Tiles of ground at hand")),
      ground_bytes_(gauge("tessera_server_ground_bytes", "Bytes of the tiles of ground at hand")),
      ground_waits_(counter("tessera_server_ground_waits_total",
                            "Tiles of ground that were not there when they were needed")),
      round_messages_(prometheus::BuildCounter()
                          .Name("tessera_server_round_messages_total")
                          .Help("Messages between this server and others, by the rounds of a tick")
                          .Register(registry_)),
      round_bytes_(prometheus::BuildCounter()
                       .Name("tessera_server_round_bytes_total")
                       .Help("Bytes of messages between this server and others, by the rounds of a tick")
                       .Register(registry_)),
      sent_(round_messages_, round_bytes_, "sent"),
      received_(round_messages_, round_bytes_, "received") {
  for (std::size_t n = 0; n < counts_.size(); ++n) {
    const TickCounter& count = kTickCounters[n];
    const std::string name = metric_name("tessera_server_", count);
    if (count.over_ticks == OverTicks::kTotal) {
      counts_[n].total = &counter(name, metric_help(count));
    } else {
      counts_[n].level = &gauge(name, metric_help(count));
    }
  }
  prometheus::BuildGauge()
      .Name("tessera_server_info")
      .Help("This sector server")
      .Register(registry_)
      .Add({{"cluster", arguments.dds.cluster},
            {"node", absl::StrFormat("%x", arguments.dds.self.value)},
            {"engine", name_of(arguments.server.precision)}})
      .Set(1);
  gauge("tessera_server_threads", "Threads that step sectors").Set(arguments.server.threads);
}

prometheus::Gauge& ServerMetrics::gauge(const std::string& name, const std::string& help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry_).Add({});
}

prometheus::Counter& ServerMetrics::counter(const std::string& name, const std::string& help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry_).Add({});
}

ServerMetrics::OfRounds::OfRounds(prometheus::Family<prometheus::Counter>& messages_of,
                                  prometheus::Family<prometheus::Counter>& bytes_of,
                                  const std::string& direction) {
  for (std::size_t n = 0; n < kRoundNames.size(); ++n) {
    const prometheus::Labels labels = {{"round", kRoundNames[n]}, {"direction", direction}};
    messages[n] = &messages_of.Add(labels);
    bytes[n] = &bytes_of.Add(labels);
  }
}

void ServerMetrics::OfRounds::show(const TrafficByRound& traffic) {
  for (std::size_t n = 0; n < kRoundNames.size(); ++n) {
    if (traffic[n].messages < last[n].messages) last[n] = {};  // another world
    messages[n]->Increment(static_cast<double>(traffic[n].messages - last[n].messages));
    bytes[n]->Increment(static_cast<double>(traffic[n].bytes - last[n].bytes));
    last[n] = traffic[n];
  }
}

void ServerMetrics::show(const v1::TickReport* tick, std::size_t bodies, const WorldRun::Traffic& traffic) {
  bodies_.Set(static_cast<double>(bodies));
  const auto sent_before = static_cast<double>(WorldRun::Traffic{.sent = sent_.last}.all_sent().bytes);
  const auto sent = static_cast<double>(traffic.all_sent().bytes);
  exchange_.Increment(sent < sent_before ? sent : sent - sent_before);
  sent_.show(traffic.sent);
  received_.show(traffic.received);
  const v1::TickReport last = tick != nullptr ? *tick : v1::TickReport();
  tick_.Set(static_cast<double>(last.tick()));
  const TickCounts counts = counts_from(last.counts());
  for (std::size_t n = 0; n < counts_.size(); ++n) {
    const auto count = static_cast<double>(counts.*kTickCounters[n].value);
    if (counts_[n].level != nullptr) counts_[n].level->Set(count);
    if (counts_[n].total != nullptr) counts_[n].total->Increment(count);
  }
  if (tick == nullptr) return;
  ticks_.Increment();
  tick_duration_.Observe(static_cast<double>(last.work_us()) / 1e6);
  own_time_.Increment(static_cast<double>(last.own_us()) / 1e6);
}

void ServerMetrics::show_ground(std::uint64_t tiles, std::uint64_t bytes, std::uint64_t waits) {
  ground_tiles_.Set(static_cast<double>(tiles));
  ground_bytes_.Set(static_cast<double>(bytes));
  ground_waits_.Increment(static_cast<double>(waits) - ground_waits_.Value());
}

void ServerMetrics::set_joined(bool joined) { joined_.Set(joined ? 1 : 0); }

absl::Status ServerMetrics::ready() const {
  if (joined_.Value() == 1) return absl::OkStatus();
  return absl::UnavailableError(
      "this server belongs to no coordinator's cluster, or the coordinator does not respond");
}

}  // namespace tessera
