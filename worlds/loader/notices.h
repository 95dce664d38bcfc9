// Notices about unsupported, repaired, changed and missing elements of a file, counted by kind and reported
// once at the end.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tessera {

class Notices {
 public:
  // `kind` continues after the number: "<light> skipped".
  void count(const std::string& kind, std::size_t times = 1) { kinds_[kind] += times; }
  // A fault of the file that was mended, or passed over: "mass of 0 kg, raised". `where` is the first place.
  void count_repair(const std::string& kind, const std::string& where);
  // Joints have separate lines, with their types.
  void count_joint(const std::string& type, std::size_t times = 1) { joints_[type] += times; }
  void count_joint_left_out(const std::string& type, std::size_t times = 1) {
    joints_left_out_[type] += times;
  }

  // Something that the file has and the world lacks, which Faults::kRefuse does not let pass: a line as that
  // of count().
  void count_loss(const std::string& kind, std::size_t times = 1) { losses_[kind] += times; }
  // A loss, too: an <include> of a model of the network that this machine does not have. All are one line.
  void count_remote_model(const std::string& uri, std::size_t times = 1) { remote_models_[uri] += times; }
  // A file that another one names, and that is not there. Reading goes on with something in its place, so
  // that all such files are told at once: missing_files() is an error then.
  void count_missing_file(const std::string& uri, const std::string& place, absl::string_view why);

  void add(const Notices& other);

  // One line per kind, in alphabetical order of the kinds; UTF-8, whatever the file has.
  std::vector<std::string> lines() const;
  std::vector<std::string> repairs() const;
  // Those of the lines that tell of losses.
  std::vector<std::string> losses() const;
  // NOT_FOUND with all files that are not there.
  absl::Status missing_files() const;

 private:
  using Counts = std::map<std::string, std::size_t>;
  struct Repair {
    std::size_t times = 0;
    std::string where;
  };

  Counts kinds_;
  std::map<std::string, Repair> repairs_;
  Counts joints_;
  Counts joints_left_out_;
  Counts losses_;
  Counts remote_models_;  // by URI
  std::vector<std::pair<std::string, std::string>>
      missing_files_;              // URIs with places, and all of the message
  std::set<std::string> missing_;  // the first of these
};

}  // namespace tessera
