// SQLite on a simulated disk.
#pragma once

#include <memory>
#include <string>

namespace tessera {

class SimulatedDisk;

// SQLite knows the disk by this name while this exists.
class DiskVfs {
 public:
  DiskVfs(SimulatedDisk& disk, const std::string& name);
  ~DiskVfs();
  DiskVfs(const DiskVfs&) = delete;
  DiskVfs& operator=(const DiskVfs&) = delete;

 private:
  struct Registered;

  std::unique_ptr<Registered> registered_;
};

}  // namespace tessera
