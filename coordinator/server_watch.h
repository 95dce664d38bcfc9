// Sees at once where the process of a sector server ends: its sockets close. (The network of the cluster
// takes a second or more to miss it.)
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "transport/link.h"

namespace tessera {

// Holds a connection to each server. A server whose connection closes, and that refuses another one, has
// ended. One that does not answer, or whose address cannot be found, is left to the network of the cluster.
class ServerWatch {
 public:
  // `wake` is called on a thread of its own when take_ended() has something.
  explicit ServerWatch(std::function<void()> wake);
  ~ServerWatch();
  ServerWatch(const ServerWatch&) = delete;
  ServerWatch& operator=(const ServerWatch&) = delete;

  // The servers to watch from now on, with their addresses, host:port.
  void follow(const std::map<NodeId, std::string>& servers);
  // Those that have ended since the last call.
  std::vector<NodeId> take_ended();

 private:
  void run();
  void signal();

  const std::function<void()> wake_;
  int event_ = -1;
  std::map<NodeId, std::string> followed_;  // of the thread that calls follow()
  std::mutex mutex_;                        // guards the following
  std::map<NodeId, std::string> wanted_;
  std::vector<NodeId> ended_;
  bool closing_ = false;
  std::thread thread_;
};

}  // namespace tessera
