#include "embedded/stream_service.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <cstdint>
#include <utility>

#include "proto/server_header.h"

namespace tessera {

void StreamService::add(NodeId node, std::shared_ptr<Streams> streams) {
  const std::lock_guard lock(mutex_);
  streams_[node] = std::move(streams);
}

void StreamService::shut_down() {
  const std::lock_guard lock(mutex_);
  for (const auto& [node, streams] : streams_) streams->shut_down();
}

template <typename Watch>
grpc::Status StreamService::pass_on(const grpc::ServerContext& context, const Watch& watch) {
  const auto given = context.client_metadata().find(kServerHeader);
  std::uint64_t node = 0;
  if (given == context.client_metadata().end() ||
      !absl::SimpleAtoi(absl::string_view(given->second.data(), given->second.size()), &node)) {
    return {grpc::StatusCode::INVALID_ARGUMENT,
            absl::StrCat("a stream needs the header ", kServerHeader, ", the node of the server")};
  }
  std::shared_ptr<Streams> streams;
  {
    const std::lock_guard lock(mutex_);
    const auto found = streams_.find(NodeId{node});
    if (found != streams_.end()) streams = found->second;
  }
  if (!streams) return {grpc::StatusCode::NOT_FOUND, absl::StrCat("there is no server with node ", node)};
  return watch(*streams);
}

grpc::Status StreamService::WatchBodies(grpc::ServerContext* context, const v1::WatchBodiesRequest* request,
                                        grpc::ServerWriter<v1::BodyBatch>* writer) {
  return pass_on(*context, [&](Streams& streams) { return streams.WatchBodies(context, request, writer); });
}

grpc::Status StreamService::WatchContacts(grpc::ServerContext* context,
                                          const v1::WatchContactsRequest* request,
                                          grpc::ServerWriter<v1::ContactBatch>* writer) {
  return pass_on(*context, [&](Streams& streams) { return streams.WatchContacts(context, request, writer); });
}

grpc::Status StreamService::WatchSeams(grpc::ServerContext* context, const v1::WatchSeamsRequest* request,
                                       grpc::ServerWriter<v1::SeamBatch>* writer) {
  return pass_on(*context, [&](Streams& streams) { return streams.WatchSeams(context, request, writer); });
}

grpc::Status StreamService::WatchDivergences(grpc::ServerContext* context,
                                             const v1::WatchDivergencesRequest* request,
                                             grpc::ServerWriter<v1::DivergenceBatch>* writer) {
  return pass_on(*context,
                 [&](Streams& streams) { return streams.WatchDivergences(context, request, writer); });
}

grpc::Status StreamService::WatchPrograms(grpc::ServerContext* context,
                                          const v1::WatchProgramsRequest* request,
                                          grpc::ServerWriter<v1::ProgramBatch>* writer) {
  return pass_on(*context, [&](Streams& streams) { return streams.WatchPrograms(context, request, writer); });
}

}  // namespace tessera
