// tessera-coordinator: the process of a cluster that serves clients, orders commands and grants ticks.
#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/coordinator.h"
#include "coordinator/folder_store.h"
#include "coordinator/options.h"
#include "coordinator/process.h"
#include "coordinator/turns.h"
#include "daemon/log.h"
#include "daemon/parent_process.h"
#include "lpss/base/freed_memory.h"
#include "proto/recording_file.h"
#include "transport/dds_link.h"

namespace tessera {
namespace {

std::string text(const absl::Status& status) { return std::string(status.message()); }

// If writing fails, the recording ends and the world continues.
void record(const v1::RecordedInput& input, std::optional<RecordingWriter>& recording) {
  if (!recording) return;
  const absl::Status status = recording->write(input);
  if (status.ok()) return;
  log_error(text(status) + ": recording has stopped");
  recording.reset();
}

// The only coordinator of its cluster.
absl::Status run_alone(CoordinatorArguments& arguments) {
  const absl::StatusOr<std::optional<ServerKeys>> keys = lock_doors(arguments);
  if (!keys.ok()) return keys.status();
  CoordinatorProcess process(arguments);
  if (absl::Status status = process.open(*keys); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<DdsLink>> link = DdsLink::create(arguments.dds);
  if (!link.ok()) {
    return absl::Status(link.status().code(),
                        "cannot join the network of the cluster: " + text(link.status()));
  }
  CoordinatorOptions options = arguments.coordinator;
  options.work_clock = steady_time;
  options.log = write_log;
  std::optional<RecordingWriter> recording;
  if (!arguments.record_inputs.empty()) {
    absl::StatusOr<RecordingWriter> writer = RecordingWriter::create(arguments.record_inputs);
    if (!writer.ok()) return writer.status();
    recording = *std::move(writer);
    options.inputs = [&recording](const v1::RecordedInput& input) { record(input, recording); };
  }
  options.worlds_before = static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch() /
                                                     std::chrono::milliseconds(1));
  std::unique_ptr<WorldStore> store;
  if (!arguments.store.empty()) {
    if (options.checkpoint_every == Nanoseconds::zero())
      return absl::InvalidArgumentError("--store needs --checkpoint-every above 0");
    absl::StatusOr<std::unique_ptr<WorldStore>> opened = open_folder_store(arguments.store);
    if (absl::IsDataLoss(opened.status())) {
      return absl::DataLossError(absl::StrCat(text(opened.status()), ": `tessera store check ",
                                              arguments.store,
                                              "` tells what is whole, and what can be done"));
    }
    if (!opened.ok()) return opened.status();
    store = *std::move(opened);
    options.store = store.get();
    options.wait_for_store = arguments.when_store_fails == kWaitForStore;
  }
  Coordinator coordinator(options);
  if (absl::Status status = coordinator.resume_stored(); !status.ok())
    return absl::Status(status.code(), arguments.store + ": " + text(status));
  if (absl::Status status = (*link)->announce_coordinator(process.address()); !status.ok()) return status;
  if (absl::Status status = process.say_ready(); !status.ok()) return status;
  process.serve(coordinator, **link, [] { return true; });
  process.close();
  return absl::OkStatus();
}

int run(CoordinatorArguments& arguments) {
  arguments.coordinator.balance_policy = parse_balance_policy(arguments.balance_policy).value();
  std::erase(arguments.etcd, "");  // an empty key or variable: none
  if (!arguments.etcd.empty()) return take_turns(arguments);
  const absl::Status status = run_alone(arguments);
  if (!status.ok()) log_error(status.message());
  return status.ok() ? 0 : 1;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  tessera::CoordinatorArguments arguments;
  const pid_t parent = getppid();
  if (const std::optional<int> code = tessera::read_arguments(argc, argv, arguments)) return *code;
  if (arguments.exit_with_parent && !tessera::end_with_parent(parent, SIGTERM)) return 1;
  tessera::return_freed_memory();
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // failures are reported by us
  tessera::start_log("coordinator", arguments.log);
  return tessera::run(arguments);
}
