// Calls of clients: what coordinator and server do with each of them, up to the ticks that follow.
#include "inputs.pb.h"
#include "proto/convert.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/small_cluster.h"

namespace tessera::fuzz {
namespace {

constexpr int kRequestsMax = 16;

RestoreChunks chunks_of(const SnapshotChunks& given) {
  return {.replace = true, .chunks = {given.all().begin(), given.all().end()}};
}

void ask(SmallCluster& cluster, const Request& request) {
  switch (request.kind_case()) {
    case Request::kLoad:
      return cluster.ask<v1::LoadReply>(request.load());
    case Request::kUnload:
      return cluster.ask<v1::UnloadReply>(request.unload());
    case Request::kRequest:
      return cluster.ask<v1::Reply>(request.request());
    case Request::kPause:
      return cluster.ask<v1::PauseReply>(request.pause());
    case Request::kResume:
      return cluster.ask<v1::ResumeReply>(request.resume());
    case Request::kStatus:
      return cluster.ask<v1::StatusReply>(request.status());
    case Request::kDrain:
      return cluster.ask<v1::DrainReply>(request.drain());
    case Request::kBalance:
      return cluster.ask<v1::BalanceReply>(request.balance());
    case Request::kShutdown:
      return cluster.ask<v1::ShutdownReply>(request.shutdown());
    case Request::kSnapshot:
      return cluster.ask<tessera::SnapshotChunks>(request.snapshot());
    case Request::kRestore:
      return cluster.ask<v1::LoadReply>(chunks_of(request.restore()));
    case Request::KIND_NOT_SET:
      return;
  }
}

}  // namespace
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  fuzz::Requests requests;
  if (!fuzz::read_text(fuzz::text_of(data, size), requests)) return 0;
  if (requests.all_size() > fuzz::kRequestsMax) return 0;
  fuzz::SmallCluster cluster;
  v1::LoadRequest load;
  *load.mutable_world() = to_proto(fuzz::small_world());
  cluster.ask<v1::LoadReply>(load);
  for (const fuzz::Request& request : requests.all()) fuzz::ask(cluster, request);
  return 0;
}
