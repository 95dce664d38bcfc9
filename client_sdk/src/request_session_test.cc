// Requests go to the coordinator in the order in which they were made, and who sends one waits for no
// network.
#include "client_sdk/src/request_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <future>
#include <memory>
#include <mutex>
#include <numeric>
#include <set>
#include <string>

namespace tessera {
namespace {

constexpr absl::Duration kReplyMax = absl::Seconds(60);

// Takes nothing until it may, and then answers each request with the number of its ticks.
class Coordinator final : public v1::Tessera::Service {
 public:
  explicit Coordinator(int wanted_port = 0) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:" + std::to_string(wanted_port), grpc::InsecureServerCredentials(),
                             &port);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
    address = "127.0.0.1:" + std::to_string(port);
  }
  ~Coordinator() override { server_->Shutdown(std::chrono::system_clock::now()); }

  grpc::Status Session(grpc::ServerContext* context,
                       grpc::ServerReaderWriter<v1::Reply, v1::Request>* stream) override {
    {
      const std::lock_guard lock(mutex_);
      clients_.insert(context->peer());
    }
    begun_.wait();
    for (v1::Request request; stream->Read(&request);) {
      v1::Reply reply;
      reply.set_number(request.number());
      reply.set_tick(request.ticks());
      stream->Write(reply);
    }
    return grpc::Status::OK;
  }
  void begin() { begin_.set_value(); }

  // The addresses of those that have opened a stream.
  std::set<std::string> clients() {
    const std::lock_guard lock(mutex_);
    return clients_;
  }

  int port = 0;
  std::string address;

 private:
  std::promise<void> begin_;
  const std::shared_future<void> begun_ = begin_.get_future().share();
  std::mutex mutex_;  // guards the following
  std::set<std::string> clients_;
  std::unique_ptr<grpc::Server> server_;
};

v1::Request step(std::uint64_t ticks, std::size_t bytes = 0) {
  v1::Request request;
  request.set_ticks(ticks);
  request.set_owner(std::string(bytes, 'x'));
  return request;
}

// Hangs up on so many who call at a port of loopback.
void hang_up(int port, int times) {
  const int door = socket(AF_INET, SOCK_STREAM, 0);
  const int yes = 1;
  setsockopt(door, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  EXPECT_EQ(bind(door, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(listen(door, times), 0);
  for (int n = 0; n < times; ++n) close(accept(door, nullptr, nullptr));
  close(door);
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

// So that one does not use up what a connection may ask for at a time.
TEST(RequestSession, ClientsOfOneProcessHaveConnectionsOfTheirOwn) {
  Coordinator coordinator;
  coordinator.begin();
  const auto connect = [&] {
    return Coordinators::connect(coordinator.address, ClientKeys(), kReplyMax).value();
  };
  RequestSession one(connect());
  RequestSession other(connect());
  ASSERT_TRUE(one.call(step(1), kReplyMax).ok());
  ASSERT_TRUE(other.call(step(1), kReplyMax).ok());
  EXPECT_EQ(coordinator.clients().size(), 2u);
}

// It takes no connection for some time.
TEST(RequestSession, WaitsForACoordinatorThatIsReplaced) {
  auto first = std::make_unique<Coordinator>();
  const int port = first->port;
  RequestSession session(Coordinators::connect(first->address, ClientKeys(), kReplyMax).value());
  first->begin();
  ASSERT_TRUE(session.call(step(1), kReplyMax).ok());
  first.reset();
  std::promise<absl::StatusOr<v1::Reply>> reply;
  session.send(step(2), [&](absl::StatusOr<v1::Reply> told) { reply.set_value(std::move(told)); });
  hang_up(port, 3);
  Coordinator next(port);
  next.begin();
  const absl::StatusOr<v1::Reply> told = reply.get_future().get();
  ASSERT_TRUE(told.ok()) << told.status();
  EXPECT_EQ(told->tick(), 2u);
}

}  // namespace
}  // namespace tessera
