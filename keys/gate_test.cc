#include "keys/gate.h"

#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>

#include "keys/keys_folder.h"
#include "keys/test_keys.h"
#include "tessera.grpc.pb.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::seconds kPatience(20);

// A server whose calls do nothing: those that are let in end with UNIMPLEMENTED.
class Door {
 public:
  explicit Door(const std::filesystem::path& keys) {
    std::optional<ServerKeys> read;
    if (!keys.empty()) read = read_server_keys(keys, kDaemonFolder).value();
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", server_credentials(read), &port_);
    builder.RegisterService(&calls_);
    builder.RegisterService(&streams_);
    server_ = builder.BuildAndStart();
  }
  ~Door() { server_->Shutdown(std::chrono::system_clock::now()); }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }

 private:
  v1::Tessera::Service calls_;
  v1::Streams::Service streams_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

grpc::Status call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                  const std::string& bearer = "") {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
  if (!bearer.empty()) context.AddMetadata("authorization", bearer);
  grpc::CompletionQueue done;
  const grpc::Slice nothing;
  const auto reader = stub.PrepareUnaryCall(&context, method, grpc::ByteBuffer(&nothing, 1), &done);
  reader->StartCall();
  grpc::ByteBuffer answer;
  grpc::Status status;
  reader->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool is_ok = false;
  done.Next(&tag, &is_ok);
  return status;
}

grpc::Status call_as(const std::filesystem::path& keys, const Door& door, const std::string& method) {
  return call(ClientKeys::read(keys).value().channel(door.address(), {}), method);
}

std::vector<std::string> all_calls() {
  std::vector<std::string> calls;
  const google::protobuf::FileDescriptor& file = *v1::StatusRequest::descriptor()->file();
  for (int s = 0; s < file.service_count(); ++s) {
    for (int m = 0; m < file.service(s)->method_count(); ++m) {
      calls.push_back(
          absl::StrCat("/", file.service(s)->full_name(), "/", file.service(s)->method(m)->name()));
    }
  }
  return calls;
}

// Every call in every role.
void expect_roles_are_kept(const TestKeys& keys, const Door& door) {
  for (const ClientRole role : {ClientRole::kObserve, ClientRole::kControl, ClientRole::kAdmin}) {
    const auto channel =
        ClientKeys::read(keys.folder() / std::string(name_of(role))).value().channel(door.address(), {});
    for (const std::string& method : all_calls()) {
      const grpc::StatusCode expected =
          role >= role_needed(method) ? grpc::StatusCode::UNIMPLEMENTED : grpc::StatusCode::PERMISSION_DENIED;
      const grpc::Status status = call(channel, method);
      EXPECT_EQ(status.error_code(), expected)
          << name_of(role) << " " << method << ": " << status.error_message();
    }
  }
}

TEST(GateTest, ACertificateMayDoWhatItsRoleMay) {
  const TestKeys keys;
  const Door door(keys.folder());
  expect_roles_are_kept(keys, door);
}

TEST(GateTest, ATokenMayDoWhatItsRoleMay) {
  const TestKeys keys;
  for (const char* client : {"observe", "control", "admin"}) {
    std::filesystem::remove(keys.folder() / client / kKeyFile);
    std::filesystem::remove(keys.folder() / client / kCertificateFile);
  }
  const Door door(keys.folder());
  expect_roles_are_kept(keys, door);
}

TEST(GateTest, TheRefusalSaysWhatIsMissing) {
  const TestKeys keys;
  const Door door(keys.folder());
  EXPECT_EQ(call_as(keys.folder() / "observe", door, "/tessera.v1.Tessera/Shutdown").error_message(),
            "the role observe may not do this: it needs admin");
  EXPECT_THAT(call_as(keys.folder() / "admin", door, "/tessera.v1.Tessera/Explode").error_message(),
              HasSubstr("there is no call"));
}

TEST(GateTest, AGatewayObservesAndIsNoDaemon) {
  const TestKeys keys;
  const Door door(keys.folder());
  const std::filesystem::path gateway = keys.folder() / kGatewayFolder;
  EXPECT_EQ(call_as(gateway, door, "/tessera.v1.Tessera/GetStatus").error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_EQ(call_as(gateway, door, "/tessera.v1.Tessera/Unload").error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(call_as(gateway, door, "/tessera.v1.Coordination/CopyStates").error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(call_as(keys.folder() / kDaemonFolder, door, "/tessera.v1.Coordination/CopyStates").error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
  // What passes on calls of others shows nothing of its own.
  const ClientKeys own = ClientKeys::read(gateway).value();
  EXPECT_EQ(
      call(own.without_identity().channel(door.address(), {}), "/tessera.v1.Tessera/GetStatus").error_code(),
      grpc::StatusCode::UNAUTHENTICATED);
}

TEST(GateTest, ATokenGoesBesideACertificate) {
  const TestKeys keys;
  // The certificate of an observer, and the token of an administrator: the higher role counts.
  std::filesystem::copy_file(keys.folder() / "admin" / kTokenFile, keys.folder() / "observe" / kTokenFile,
                             std::filesystem::copy_options::overwrite_existing);
  const Door door(keys.folder());
  EXPECT_EQ(call_as(keys.folder() / "observe", door, "/tessera.v1.Tessera/Unload").error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST(GateTest, StrangersMayDoNothing) {
  const TestKeys keys;
  const TestKeys others;
  const Door door(keys.folder());
  // Who only knows whom to trust: no certificate, no token.
  grpc::ChannelArguments arguments;
  arguments.SetSslTargetNameOverride(kDaemonName);
  const std::string authority = read_key_file(keys.folder() / "authority" / kAuthorityFile).value();
  const auto anonymous = grpc::CreateCustomChannel(
      door.address(),
      grpc::SslCredentials({.pem_root_certs = authority, .pem_private_key = "", .pem_cert_chain = ""}),
      arguments);
  const auto plain = grpc::CreateChannel(door.address(), grpc::InsecureChannelCredentials());
  const std::string foreign_token = read_key_file(others.folder() / "admin" / kTokenFile).value();
  for (const std::string& method : all_calls()) {
    EXPECT_EQ(call(anonymous, method).error_code(), grpc::StatusCode::UNAUTHENTICATED) << method;
    EXPECT_EQ(call(anonymous, method, "Bearer guessed").error_code(), grpc::StatusCode::UNAUTHENTICATED)
        << method;
    EXPECT_EQ(call(anonymous, method, absl::StrCat("Bearer ", foreign_token.substr(0, 43))).error_code(),
              grpc::StatusCode::UNAUTHENTICATED)
        << method;
    EXPECT_EQ(call(plain, method).error_code(), grpc::StatusCode::UNAVAILABLE) << method;
  }
  // Keys of another cluster, of either side.
  EXPECT_EQ(call_as(others.folder() / "admin", door, "/tessera.v1.Tessera/GetStatus").error_code(),
            grpc::StatusCode::UNAVAILABLE);
  std::filesystem::copy_file(keys.folder() / "authority" / kAuthorityFile,
                             others.folder() / "admin" / kAuthorityFile,
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(call_as(others.folder() / "admin", door, "/tessera.v1.Tessera/GetStatus").error_code(),
            grpc::StatusCode::UNAVAILABLE);
}

// A client's key does not make a daemon, nor does the web UI's.
TEST(GateTest, ClientsTrustDaemonsOnly) {
  const TestKeys keys;
  for (const char* impostor : {"viewer", "admin"}) {
    std::filesystem::copy_file(keys.folder() / "daemon" / kTokensFile, keys.folder() / impostor / kTokensFile,
                               std::filesystem::copy_options::overwrite_existing);
    const Door door(keys.folder() / impostor);
    EXPECT_EQ(call_as(keys.folder() / "control", door, "/tessera.v1.Tessera/GetStatus").error_code(),
              grpc::StatusCode::UNAVAILABLE)
        << impostor;
  }
}

// The daemons' certificate names no role: coordinators call each other, and nobody else.
TEST(GateTest, ADaemonCallsDaemonsOnly) {
  const TestKeys keys;
  const Door door(keys.folder());
  const auto code = [&](const std::string& call) {
    return call_as(keys.folder() / kDaemonFolder, door, call).error_code();
  };
  EXPECT_EQ(code("/tessera.v1.Coordination/CopyStates"), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_EQ(code("/tessera.v1.Coordination/CopyStates/"), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(code("/tessera.v1.Tessera/GetStatus"), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(call_as(keys.folder() / "control", door, "/tessera.v1.Coordination/CopyStates").error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
}

TEST(GateTest, WithoutKeysAllIsOpen) {
  const Door door("");
  for (const std::string& method : all_calls()) {
    EXPECT_EQ(call_as("", door, method).error_code(), grpc::StatusCode::UNIMPLEMENTED) << method;
  }
}

TEST(KeysFolderTest, MissingFilesAreNamed) {
  const TestKeys keys;
  EXPECT_THAT(std::string(ClientKeys::read(keys.folder() / "nobody").status().message()),
              HasSubstr(kAuthorityFile));
  EXPECT_THAT(std::string(read_server_keys(keys.folder() / "admin", kDaemonFolder).status().message()),
              HasSubstr(kTokensFile));
  std::filesystem::remove(keys.folder() / "admin" / kKeyFile);
  std::filesystem::remove(keys.folder() / "admin" / kTokenFile);
  EXPECT_THAT(std::string(ClientKeys::read(keys.folder()).status().message()), HasSubstr("neither"));
}

}  // namespace
}  // namespace tessera
