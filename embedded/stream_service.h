// The streams of all servers of an embedded cluster, at one address.
#pragma once

#include <grpcpp/grpcpp.h>

#include <map>
#include <memory>
#include <mutex>

#include "sector_server/streams.h"
#include "tessera.grpc.pb.h"
#include "transport/link.h"

namespace tessera {

// As a gateway, it is told by a header for which server a call is (proto/server_header.h).
class StreamService final : public v1::Streams::Service {
 public:
  void add(NodeId node, std::shared_ptr<Streams> streams);
  // Ends all streams.
  void shut_down();

  grpc::Status WatchBodies(grpc::ServerContext* context, const v1::WatchBodiesRequest* request,
                           grpc::ServerWriter<v1::BodyBatch>* writer) override;
  grpc::Status WatchContacts(grpc::ServerContext* context, const v1::WatchContactsRequest* request,
                             grpc::ServerWriter<v1::ContactBatch>* writer) override;
  grpc::Status WatchSeams(grpc::ServerContext* context, const v1::WatchSeamsRequest* request,
                          grpc::ServerWriter<v1::SeamBatch>* writer) override;
  grpc::Status WatchDivergences(grpc::ServerContext* context, const v1::WatchDivergencesRequest* request,
                                grpc::ServerWriter<v1::DivergenceBatch>* writer) override;
  grpc::Status WatchPrograms(grpc::ServerContext* context, const v1::WatchProgramsRequest* request,
                             grpc::ServerWriter<v1::ProgramBatch>* writer) override;

 private:
  template <typename Watch>
  grpc::Status pass_on(const grpc::ServerContext& context, const Watch& watch);

  std::mutex mutex_;  // guards the following
  std::map<NodeId, std::shared_ptr<Streams>> streams_;
};

}  // namespace tessera
