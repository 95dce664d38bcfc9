// Messages of the web UI's page: what is read of each, up to the call of the coordinator that it asks for. No
// coordinator is there: a server of nothing refuses every call.
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include "lpss/base/invariant.h"
#include "tests/fuzz/input.h"
#include "viewer/hosts.h"
#include "viewer/json.h"
#include "viewer/page_requests.h"

namespace tessera::viewer {
namespace {

struct NoCoordinator {
  NoCoordinator() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterCallbackGenericService(&service);
    server = builder.BuildAndStart();
    client = Client::connect("127.0.0.1:" + std::to_string(port)).value();
  }

  grpc::CallbackGenericService service;  // which implements nothing
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<Client> client;
};

live::ClusterReport report_of_a_world() {
  live::ClusterReport report;
  report.cluster.settings.emplace();
  return report;
}

void hear(std::string_view text) {
  static NoCoordinator* const nobody = new NoCoordinator();  // its threads outlive the inputs
  static const live::ClusterReport report = report_of_a_world();
  static const Hosts hosts({"lab.example"});
  static_cast<void>(hosts.allows(text));
  const nlohmann::json message = message_from(text);
  if (message.is_discarded()) return;
  invariant(!message_from(dump(message)).is_discarded(), "a message can be read as it is written");
  static_cast<void>(position_from(message));
  static_cast<void>(vector_from(message));
  for (const bool read_only : {true, false}) {
    PageOptions options;
    options.read_only = read_only;
    std::optional<NewBody> removed;
    static_cast<void>(answer({*nobody->client, report, options, removed}, message));
  }
}

}  // namespace
}  // namespace tessera::viewer

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tessera::viewer::hear(tessera::fuzz::text_of(data, size));
  return 0;
}
