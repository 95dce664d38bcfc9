// The sector server's options: command line, environment and configuration file.
#pragma once

#include <CLI/App.hpp>
#include <string>

#include "daemon/locks.h"
#include "daemon/log.h"
#include "lpss/ground/tile_store.h"
#include "sector_server/sector_server.h"
#include "transport/dds_link.h"

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

}  // namespace tessera
