#include "daemon/grpc_door.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <vector>

#include "daemon/address.h"
#include "proto/grpc_limits.h"
#include "tessera.grpc.pb.h"
#include "transport/descriptor.h"

namespace tessera {
namespace {

constexpr std::chrono::seconds kPatience{60};  // for machines that are busy
constexpr std::size_t kIdle = 64;

// A server whose calls do nothing: those that get through end with UNIMPLEMENTED.
class GrpcDoorTest : public ::testing::Test {
 protected:
  void open(std::size_t connections_max) {
    grpc::ServerBuilder builder;
    limit_clients(builder, /*threads_max=*/8);
    builder.RegisterService(&calls_);
    auto opened = GrpcDoor::open("127.0.0.1:0", std::nullopt, connections_max, builder);
    ASSERT_TRUE(opened.ok()) << opened.status();
    door_ = *std::move(opened);
    server_ = builder.BuildAndStart();
    door_->let_in();
  }
  void TearDown() override {
    door_.reset();
    server_->Shutdown(std::chrono::system_clock::now());
  }

  void connect_idle() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(parse_listen_address(door_->address()).value().port));
    for (const Descriptor& client : idle_) {
      ASSERT_EQ(connect(client.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    }
  }
  grpc::StatusCode ask() const {
    const auto stub =
        v1::Tessera::NewStub(grpc::CreateChannel(door_->address(), grpc::InsecureChannelCredentials()));
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    context.set_wait_for_ready(true);
    v1::StatusReply reply;
    return stub->GetStatus(&context, {}, &reply).error_code();
  }
  static std::vector<Descriptor> idle_sockets() {
    std::vector<Descriptor> sockets;
    for (std::size_t n = 0; n < kIdle; ++n) sockets.emplace_back(socket(AF_INET, SOCK_STREAM, 0));
    return sockets;
  }

  std::vector<Descriptor> idle_ = idle_sockets();
  v1::Tessera::Service calls_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<GrpcDoor> door_;
};

// Whether the door has closed a connection: it sends nothing itself.
bool is_closed(const Descriptor& client) {
  char byte = 0;
  return recv(client.get(), &byte, 1, 0) <= 0;
}

TEST_F(GrpcDoorTest, ClosesConnectionsThatAreTooMany) {
  open(/*connections_max=*/32);
  connect_idle();
  // Half of the 32 may come from one address; gRPC greets these.
  std::size_t closed = 0;
  for (const Descriptor& client : idle_) closed += is_closed(client) ? 1 : 0;
  EXPECT_EQ(closed, kIdle - 16);
  idle_.clear();
  EXPECT_EQ(ask(), grpc::StatusCode::UNIMPLEMENTED) << "those that ended have no place";
}

TEST_F(GrpcDoorTest, GoesOnOnceThereAreDescriptorsAgain) {
  open(/*connections_max=*/1024);
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit few{.rlim_cur = static_cast<rlim_t>(Descriptor(dup(0)).get() + 8),
                   .rlim_max = before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  connect_idle();
  // Until no descriptor is left.
  while (Descriptor(dup(0)).is_open()) {
  }
  idle_.clear();
  EXPECT_EQ(ask(), grpc::StatusCode::UNIMPLEMENTED);
  setrlimit(RLIMIT_NOFILE, &before);
}

TEST(ClientConnectionsMaxTest, LeavesFilesForTheProcessItself) {
  EXPECT_EQ(client_connections_max(1'048'576), kClientConnectionsMax);
  EXPECT_EQ(client_connections_max(4096), 3072u);
  EXPECT_EQ(client_connections_max(1024), 512u);
  EXPECT_EQ(client_connections_max(0), 0u);
}

}  // namespace
}  // namespace tessera
