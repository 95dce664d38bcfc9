// ROS packages by their own names, whatever their folders are called.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>

namespace tessera {

class PackageIndex {
 public:
  // The folder of the package whose package.xml has this <name>, at most `levels` below `folder`: the first
  // one in alphabetical order, the nearest ones before those farther down. Nothing (an empty path) if there
  // is none. Packages are not searched for further ones, nor are hidden folders and those that symbolic links
  // lead to. A folder is read once, and of all folders at most kFoldersMax.
  std::filesystem::path find(const std::filesystem::path& folder, int levels, const std::string& name);

  static constexpr int kFoldersMax = 20'000;

 private:
  using Names = std::map<std::string, std::filesystem::path>;

  void read(const std::filesystem::path& folder, int levels, Names& names);

  std::map<std::pair<std::filesystem::path, int>, Names> indices_;
  int folders_ = 0;
};

}  // namespace tessera
