// The Python module tessera._native: a cluster inside the process, and the reader of world files. Worlds,
// requests and answers are serialised messages; the package makes classes of it.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "embedded/embedded_cluster.h"
#include "proto/convert.h"
#include "proto/snapshot_file.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

namespace py = pybind11;

// A status code of gRPC, and what belongs to it: an answer if it is 0, otherwise a message.
using Outcome = std::tuple<int, py::bytes>;

// Without the interpreter's lock.
using Work = std::function<absl::StatusOr<std::string>()>;

Outcome outcome_of(const absl::StatusOr<std::string>& result) {
  if (result.ok()) return {0, py::bytes(*result)};
  return {static_cast<int>(result.status().code()), py::bytes(std::string(result.status().message()))};
}

class PythonCluster {
 public:
  PythonCluster(bool is_double, std::uint32_t servers, int threads)
      : cluster_({is_double ? Precision::kFloat64 : Precision::kFloat32, servers, threads, {}}) {}

  Outcome call(const std::string& method, const std::string& request, std::optional<double> timeout_s) {
    const auto found = std::ranges::find(kMethods, method, &Method::name);
    if (found == kMethods.end()) throw py::key_error(method);
    return run([&] { return (this->*found->call)(request, in_time(timeout_s)); });
  }

  // The bytes of a file of a snapshot.
  Outcome snapshot(std::optional<double> timeout_s) {
    return run([&]() -> absl::StatusOr<std::string> {
      const absl::StatusOr<SnapshotChunks> chunks =
          cluster_.call<v1::SnapshotRequest, SnapshotChunks>({}, in_time(timeout_s), kIsInterrupted);
      if (!chunks.ok()) return chunks.status();
      SnapshotEncoder encoder;
      std::string file;
      for (const v1::SnapshotChunk& chunk : *chunks) {
        const absl::StatusOr<std::string> bytes = encoder.encode(chunk);
        if (!bytes.ok()) return bytes.status();
        file += *bytes;
      }
      return file;
    });
  }

  Outcome restore(std::string_view file, bool replace, std::optional<double> timeout_s) {
    return run([&]() -> absl::StatusOr<std::string> {
      SnapshotDecoder decoder;
      if (absl::Status status = decoder.add(file); !status.ok()) return status;
      absl::StatusOr<SnapshotChunks> chunks = decoder.finish();
      if (!chunks.ok()) return chunks.status();
      return serialised(cluster_.call<RestoreChunks, v1::LoadReply>(
          {replace, /*replay=*/false, *std::move(chunks)}, in_time(timeout_s), kIsInterrupted));
    });
  }

  // The address.
  Outcome serve(const std::string& listen) {
    return run([&] { return cluster_.serve(listen); });
  }

 private:
  using Timeout = std::optional<Nanoseconds>;
  struct Method {
    std::string_view name;
    absl::StatusOr<std::string> (PythonCluster::*call)(const std::string& request, Timeout timeout);
  };

  static Timeout in_time(std::optional<double> seconds) {
    constexpr double kMax = 1e9;
    if (!seconds || *seconds > kMax) return std::nullopt;
    return std::chrono::duration_cast<Nanoseconds>(std::chrono::duration<double>(*seconds));
  }

  template <typename Answer>
  static absl::StatusOr<std::string> serialised(const absl::StatusOr<Answer>& answer) {
    if (!answer.ok()) return answer.status();
    return answer->SerializeAsString();
  }

  template <typename Request, typename Answer>
  absl::StatusOr<std::string> answer(const std::string& bytes, Timeout timeout) {
    Request request;
    if (!request.ParseFromString(bytes)) return absl::InvalidArgumentError("the request is no message");
    return serialised(cluster_.call<Request, Answer>(std::move(request), timeout, kIsInterrupted));
  }

  // Where a signal came, such as Ctrl-C, its exception is raised, after a world that was being stepped has
  // stopped.
  Outcome run(const Work& work) {
    absl::StatusOr<std::string> result;
    {
      const py::gil_scoped_release unlocked;
      result = work();
      if (absl::IsCancelled(result.status()))
        cluster_.call<v1::PauseRequest, v1::PauseReply>({}).IgnoreError();
    }
    if (PyErr_Occurred() != nullptr) throw py::error_already_set();
    return outcome_of(result);
  }

  static bool is_interrupted() {
    const py::gil_scoped_acquire locked;
    return PyErr_CheckSignals() != 0;
  }

  static constexpr auto kIsInterrupted = &PythonCluster::is_interrupted;
  static const std::array<Method, 9> kMethods;

  EmbeddedCluster cluster_;
};

const std::array<PythonCluster::Method, 9> PythonCluster::kMethods = {{
    {"Load", &PythonCluster::answer<v1::LoadRequest, v1::LoadReply>},
    {"Unload", &PythonCluster::answer<v1::UnloadRequest, v1::UnloadReply>},
    {"Do", &PythonCluster::answer<v1::Request, v1::Reply>},
    {"Pause", &PythonCluster::answer<v1::PauseRequest, v1::PauseReply>},
    {"Resume", &PythonCluster::answer<v1::ResumeRequest, v1::ResumeReply>},
    {"GetStatus", &PythonCluster::answer<v1::StatusRequest, v1::StatusReply>},
    {"Drain", &PythonCluster::answer<v1::DrainRequest, v1::DrainReply>},
    {"Balance", &PythonCluster::answer<v1::BalanceRequest, v1::BalanceReply>},
    {"Shutdown", &PythonCluster::answer<v1::ShutdownRequest, v1::ShutdownReply>},
}};

// The status code and message, which is empty if the code is 0; a serialised World; notices; repairs.
using ReadWorld = std::tuple<int, std::string, py::bytes, std::vector<std::string>, std::vector<std::string>>;

ReadWorld read_world(const std::string& file) {
  absl::StatusOr<LoadedWorld> loaded;
  std::string world;
  {
    const py::gil_scoped_release unlocked;
    loaded = load_world_file(file);
    if (loaded.ok()) world = to_proto(loaded->world).SerializeAsString();
  }
  if (!loaded.ok()) {
    return {static_cast<int>(loaded.status().code()), std::string(loaded.status().message()), {}, {}, {}};
  }
  return {0, "", py::bytes(world), loaded->notices, loaded->repairs};
}

}  // namespace
}  // namespace tessera

PYBIND11_MODULE(_native, module) {
  namespace py = pybind11;
  using tessera::PythonCluster;
  module.def("read_world", &tessera::read_world, py::arg("file"));
  py::class_<PythonCluster>(module, "Cluster")
      .def(py::init<bool, std::uint32_t, int>(), py::arg("is_double"), py::arg("servers"), py::arg("threads"))
      .def("call", &PythonCluster::call, py::arg("method"), py::arg("request"), py::arg("timeout"))
      .def("snapshot", &PythonCluster::snapshot, py::arg("timeout"))
      .def("serve", &PythonCluster::serve, py::arg("listen"))
      .def("restore", &PythonCluster::restore, py::arg("file"), py::arg("replace"), py::arg("timeout"));
}
