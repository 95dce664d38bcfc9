// Real clusters and small worlds for tests of whole processes. Nothing here sleeps: all waits are for a
// condition, with a deadline.
#pragma once

#include <absl/status/status.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "cli/child_process.h"
#include "cli/local_cluster.h"
#include "lpss/model/world_description.h"
#include "tessera/client.h"

namespace tessera::testing {

inline constexpr absl::Duration kPatience = absl::Seconds(60 * TESSERA_SLOWNESS);  // the machine may be busy

// A file in worlds/.
std::filesystem::path world_file(const std::string& name);
WorldDescription read_world(const std::string& name);

// A plane through z = 0 and nothing else, in sectors of `sector_size`.
WorldDescription flat_world(double sector_size);
// Adds the body to a world that is not loaded yet; its position is relative to the centre of sector (0, 0, 0)
// and may be arbitrarily large.
BodyDescription& add(WorldDescription& world, const NewBody& body);

// The hash after `ticks` ticks in one process.
std::string hash_in_process(const WorldDescription& world, std::uint64_t ticks);

struct Cluster {
  std::unique_ptr<cli::LocalCluster> processes;
  std::unique_ptr<Client> client;
};
// Fails the test and returns an empty Cluster if it cannot be started.
Cluster start_cluster(int servers, const cli::LocalClusterOptions& options = {});

// Waits until the log of the coordinator contains `text`; false on timeout.
bool await_log(const Cluster& cluster, const std::string& text);
// Waits until `servers` servers have joined, one after the other.
bool await_joined(const Cluster& cluster, int servers);

// The name of every file in /dev/shm.
std::set<std::string> shared_memory();
bool runs(pid_t process);
std::vector<pid_t> children_of(pid_t process);
std::string name_of(pid_t process);  // the first 15 characters of its program's name

// Processes that may have lost their parent.
class Processes {
 public:
  explicit Processes(std::vector<pid_t> ids);
  Processes(const Processes&) = delete;
  ~Processes();

  const std::vector<pid_t>& ids() const { return ids_; }
  // Waits until all have ended; false on timeout.
  bool await_end() const;

 private:
  std::vector<pid_t> ids_;
  std::vector<int> descriptors_;
};

// A program from the folder of this one, with its output in a file.
class Process {
 public:
  Process(const std::string& name, const std::vector<std::string>& arguments);
  ~Process();

  cli::ChildProcess& process() { return *process_; }
  // Waits for its end. Returns the exit code, or the negative number of a signal.
  int wait();
  // Waits until its output contains `text`, or it has ended; returns whether the output contains it.
  bool await_output(const std::string& text);
  std::string output() const;

 private:
  std::filesystem::path folder_;
  absl::StatusOr<cli::ChildProcess> process_;
};

// Plus the number of the signal: the exit code after an orderly end by a signal.
inline constexpr int kSignalled = 128;

// The result of `tessera` with these arguments.
struct Outcome {
  int code;
  std::string output;
};
Outcome run_tessera(const std::vector<std::string>& arguments);

MATCHER(IsOk, "is OK") {
  *result_listener << arg.ToString();
  return arg.ok();
}
MATCHER_P2(IsStatus, code, message, std::string("has the code and says ") + message) {
  *result_listener << arg.ToString();
  return arg.code() == code && std::string(arg.message()).find(message) != std::string::npos;
}

}  // namespace tessera::testing
