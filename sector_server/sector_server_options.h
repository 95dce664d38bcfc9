// What a sector server is told when it starts. Apart from it, since programs' options need nothing else.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "daemon/log_line.h"
#include "lpss/model/precision.h"
#include "lpss/partition/partition.h"
#include "proto/server_traits.h"

namespace tessera {

namespace v1 {
class LoadWorld;
class Subscriptions;
}  // namespace v1
struct NewServers;

using Nanoseconds = std::chrono::nanoseconds;

struct SectorServerOptions {
  Precision precision = Precision::kFloat32;
  int threads = 1;
  double capacity = 0;  // how much of a world it takes, by comparison with others; 0: as much as its threads
  Labels labels;
  std::string stream_address;                           // where clients open streams
  Nanoseconds join_timeout = std::chrono::seconds(30);  // how long to wait for a coordinator's welcome
  // How long to wait for a coordinator that has stopped responding, or for the one that takes its place.
  Nanoseconds coordinator_timeout = std::chrono::seconds(60);
  // As of Partition; the same for all servers of a world.
  std::uint32_t all_linked_max = kAllLinkedMax;
  std::function<std::uint64_t()> peak_rss_bytes;  // for reports; may be empty, like those below
  // Called before the observer when a world has been loaded.
  std::function<void(const v1::LoadWorld&)> on_load;
  // Called when a change of the world's servers begins that this one takes part in: before the first tick of
  // the new ones. And when this server no longer takes part.
  std::function<void(const NewServers&)> on_new_servers;
  std::function<void()> on_left;
  // The streams of clients, if they are others than at the last call.
  std::function<std::optional<v1::Subscriptions>()> changed_subscriptions;
  LogSink log;  // events for the operator
};

}  // namespace tessera
