#include "client_sdk/live/client_program.h"

#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <memory>

#include "daemon/end_signals.h"
#include "daemon/options.h"
#include "daemon/parse_command_line.h"

namespace tessera::live {

void add_client_options(CLI::App& app, ClientOptions& options) {
  app.add_option("--connect", options.connect,
                 "host:port of the coordinator; of several, all of them, separated by commas")
      ->envname("TESSERA_ADDRESS")
      ->capture_default_str();
  app.add_option("--keys", options.keys, "folder of `tessera keys create`, for a cluster with keys")
      ->envname("TESSERA_KEYS");
  add_log_options(app, options.log);
}

int run_client(CLI::App& app, int argc, char** argv, const ClientOptions& options,
               const std::function<absl::Status(Client& client, const std::function<void()>& wait)>& serve) {
  add_version_flag(app);
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // failures are reported by us
  signal(SIGPIPE, SIG_IGN);                           // do not end because a reader has gone
  start_log(app.get_name(), options.log);
  const EndSignals end;
  absl::Status status;
  if (const auto client = Client::connect(options.connect, kCallTimeout, options.keys); client.ok()) {
    status = serve(**client, [&end] { end.wait(); });
  } else {
    status = client.status();
  }
  if (status.ok()) return 0;
  log_error(status.message());
  return 1;
}

}  // namespace tessera::live
