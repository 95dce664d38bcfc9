// Requests go to the coordinator in the order in which they were made, and who sends one waits for no
// network.
#include "client_sdk/src/request_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <numeric>
#include <string>

namespace tessera {
namespace {

constexpr absl::Duration kReplyMax = absl::Seconds(60);

// Takes nothing until it may, and then answers each request with the number of its ticks.
class Coordinator final : public v1::Tessera::Service {
 public:
  Coordinator() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
    address = "127.0.0.1:" + std::to_string(port);
  }
  ~Coordinator() override { server_->Shutdown(); }

  grpc::Status Session(grpc::ServerContext*,
                       grpc::ServerReaderWriter<v1::Reply, v1::Request>* stream) override {
    begin_.get_future().wait();
    for (v1::Request request; stream->Read(&request);) {
      v1::Reply reply;
      reply.set_number(request.number());
      reply.set_tick(request.ticks());
      stream->Write(reply);
    }
    return grpc::Status::OK;
  }
  void begin() { begin_.set_value(); }

  std::string address;

 private:
  std::promise<void> begin_;
  std::unique_ptr<grpc::Server> server_;
};

v1::Request step(std::uint64_t ticks, std::size_t bytes = 0) {
  v1::Request request;
  request.set_ticks(ticks);
  request.set_owner(std::string(bytes, 'x'));
  return request;
}

// What was sent is more than the network has room for, and a call comes after it.
TEST(RequestSession, SendsWhileTheCoordinatorDoesNotKeepUp) {
  constexpr std::uint64_t kCount = 600;
  constexpr std::size_t kBytes = 64 << 10;
  Coordinator coordinator;
  RequestSession session(Coordinators::connect(coordinator.address, ClientKeys(), kReplyMax).value());
  std::vector<std::uint64_t> ticks;  // on the thread of the session
  for (std::uint64_t n = 1; n <= kCount; ++n) {
    session.send(step(n, kBytes), [&](const absl::StatusOr<v1::Reply>& reply) {
      ticks.push_back(reply.ok() ? reply->tick() : 0);
    });
  }
  coordinator.begin();
  const absl::StatusOr<v1::Reply> last = session.call(step(kCount + 1), kReplyMax);
  ASSERT_TRUE(last.ok()) << last.status();
  EXPECT_EQ(last->tick(), kCount + 1);
  std::vector<std::uint64_t> expected(kCount);
  std::iota(expected.begin(), expected.end(), 1);
  EXPECT_EQ(ticks, expected);
}

}  // namespace
}  // namespace tessera
