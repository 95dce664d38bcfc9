// What a loader left out, counted by kind: said once at the end, not once an element.
#pragma once

#include <absl/strings/str_cat.h>

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace tessera {

class Notices {
 public:
  // `kind` reads on after the number: "<visual> skipped".
  void count(const std::string& kind, std::size_t times = 1) { kinds_[kind] += times; }
  // Joints have a line of their own, with their types.
  void count_joint(const std::string& type, std::size_t times = 1) { joints_[type] += times; }

  // Adds all of `other`, `times` over.
  void add(const Notices& other, std::size_t times = 1) {
    for (const auto& [kind, n] : other.kinds_) kinds_[kind] += n * times;
    for (const auto& [type, n] : other.joints_) joints_[type] += n * times;
  }

  // One line a kind, in alphabetical order of the kinds.
  std::vector<std::string> lines() const {
    std::vector<std::string> result;
    for (const auto& [kind, n] : kinds_) result.push_back(absl::StrCat(n, " x ", kind));
    if (joints_.empty()) return result;
    std::size_t total = 0;
    std::string types;
    for (const auto& [type, n] : joints_) {
      total += n;
      absl::StrAppend(&types, types.empty() ? "" : ", ", n, " ", type);
    }
    result.push_back(
        absl::StrCat(total, " joints are not simulated yet (", types, "): their links move freely"));
    return result;
  }

 private:
  std::map<std::string, std::size_t> kinds_;
  std::map<std::string, std::size_t> joints_;
};

}  // namespace tessera
