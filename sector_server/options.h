// The sector server's options: command line, environment and configuration file.
#pragma once

#include <optional>
#include <string>

#include "daemon/locks.h"
#include "daemon/log.h"
#include "lpss/ground/tile_store.h"
#include "sector_server/sector_server_options.h"
#include "transport/dds_link.h"

namespace CLI {
class App;
}

namespace tessera {

struct SectorServerArguments {
  DdsOptions dds;
  SectorServerOptions server;
  std::string listen = "127.0.0.1:0";
  std::string metrics_address;  // empty: no metrics
  LogOptions log;
  KeysOptions keys;
  TileStore::Options ground;
  bool exit_with_parent = false;
};

inline constexpr const char* kSectorServerName = "tessera-sector-server";

// Adds every option to `app`, which is named kSectorServerName.
void add_options(CLI::App& app, SectorServerArguments& arguments);

// Reads the command line, the environment and the configuration file. Returns the exit code if the process
// must end now, after printing help or because of an error.
std::optional<int> read_arguments(int argc, char** argv, SectorServerArguments& arguments);

}  // namespace tessera
