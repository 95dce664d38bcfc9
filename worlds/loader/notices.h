// Notices about unsupported and changed elements of a file, counted by kind and reported once at the end.
#pragma once

#include <absl/strings/str_cat.h>

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace tessera {

class Notices {
 public:
  // `kind` continues after the number: "<visual> skipped".
  void count(const std::string& kind, std::size_t times = 1) { kinds_[kind] += times; }
  // Joints have separate lines, with their types.
  void count_joint(const std::string& type, std::size_t times = 1) { joints_[type] += times; }
  void count_joint_left_out(const std::string& type, std::size_t times = 1) {
    joints_left_out_[type] += times;
  }

  // Adds `other`, `times` times.
  void add(const Notices& other, std::size_t times = 1) {
    for (const auto& [kind, n] : other.kinds_) kinds_[kind] += n * times;
    for (const auto& [type, n] : other.joints_) joints_[type] += n * times;
    for (const auto& [type, n] : other.joints_left_out_) joints_left_out_[type] += n * times;
  }

  // One line per kind, in alphabetical order of the kinds.
  std::vector<std::string> lines() const {
    std::vector<std::string> result;
    for (const auto& [kind, n] : kinds_) result.push_back(absl::StrCat(n, " x ", kind));
    if (!joints_.empty()) result.push_back(absl::StrCat(summary(joints_), " simulated"));
    if (!joints_left_out_.empty()) {
      result.push_back(absl::StrCat(summary(joints_left_out_), " not simulated: their links move freely"));
    }
    return result;
  }

 private:
  using Counts = std::map<std::string, std::size_t>;

  // "3 joints (1 ball, 2 revolute)".
  static std::string summary(const Counts& counts) {
    std::size_t total = 0;
    std::string types;
    for (const auto& [type, n] : counts) {
      total += n;
      absl::StrAppend(&types, types.empty() ? "" : ", ", n, " ", type);
    }
    return absl::StrCat(total, total == 1 ? " joint (" : " joints (", types, ")");
  }

  Counts kinds_;
  Counts joints_;
  Counts joints_left_out_;
};

}  // namespace tessera
