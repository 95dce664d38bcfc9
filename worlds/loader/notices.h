// Notices about unsupported, repaired and changed elements of a file, counted by kind and reported once at
// the end.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace tessera {

class Notices {
 public:
  // `kind` continues after the number: "<visual> skipped".
  void count(const std::string& kind, std::size_t times = 1) { kinds_[kind] += times; }
  // A fault of the file that was mended, or passed over: "mass of 0 kg, raised". `where` is the first place.
  void count_repair(const std::string& kind, const std::string& where);
  // Joints have separate lines, with their types.
  void count_joint(const std::string& type, std::size_t times = 1) { joints_[type] += times; }
  void count_joint_left_out(const std::string& type, std::size_t times = 1) {
    joints_left_out_[type] += times;
  }

  void add(const Notices& other);

  // One line per kind, in alphabetical order of the kinds; UTF-8, whatever the file has.
  std::vector<std::string> lines() const;
  std::vector<std::string> repairs() const;

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
};

}  // namespace tessera
