// Command-line options common to all daemons.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "daemon/locks.h"
#include "daemon/log.h"
#include "proto/server_traits.h"
#include "transport/dds_link.h"

namespace CLI {
class App;
}

namespace tessera {

// Options common to all daemons are in this group of the help, and precede the sections of a configuration
// file.
inline constexpr const char* kSharedOptions = "Options of all daemons";

// --version: the name of the program and the version of this build.
void add_version_flag(CLI::App& app);

void add_log_options(CLI::App& app, LogOptions& log);

// --keys and --insecure.
void add_keys_options(CLI::App& app, KeysOptions& keys);

void add_shared_options(CLI::App& app, DdsOptions& dds, LogOptions& log, KeysOptions& keys);

void add_metrics_option(CLI::App& app, std::string& metrics_address);

// A duration, given in seconds.
void add_seconds(CLI::App& app, const std::string& name, std::chrono::nanoseconds& value,
                 const std::string& help, double low, double high);

// A number of bytes, given in MiB.
void add_mebibytes(CLI::App& app, const std::string& name, std::size_t& bytes, const std::string& help);

// Labels, between commas; refused as check_labels() says.
void add_labels(CLI::App& app, const std::string& name, Labels& labels, const std::string& help);

// For a process that another process starts for its own use.
void add_parent_option(CLI::App& app, bool& exit_with_parent);

// Reads the command line, the environment and the configuration file. Returns the exit code if the process
// must end now, after printing help or because of an error.
std::optional<int> parse_arguments(CLI::App& app, int argc, char** argv);

}  // namespace tessera
