// One client of a door, and its connection to the server behind it.
#pragma once

#include <poll.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

#include "daemon/door_socket.h"
#include "transport/descriptor.h"

namespace tessera {

// So long may a client take from its connection to the end of its request.
inline constexpr std::chrono::seconds kRequestMax{5};

class DoorRelay {
 public:
  using Clock = std::chrono::steady_clock;

  // To the server at `server_port` of loopback.
  DoorRelay(DoorSocket client, int server_port) : client_(std::move(client)), server_port_(server_port) {}

  // Whether the client has sent a request, and the server has it.
  bool is_served() const { return server_.is_open(); }

  // What poll() is to wait for; the server's place is empty before a request.
  std::array<pollfd, 2> polled() const;

  // Carries what can be carried now; with `may_be_served`, a request may go to the server. False when the
  // connection is over.
  bool carry(bool may_be_served);

 private:
  // Bytes on their way in one direction.
  class Pipe {
   public:
    explicit Pipe(std::size_t bytes_max) : buffer_(bytes_max) {}

    bool empty() const { return bytes_ == 0; }
    bool full() const { return bytes_ == buffer_.size(); }
    char* free_space() { return buffer_.data() + bytes_; }
    std::size_t free_bytes() const { return buffer_.size() - bytes_; }
    void filled(std::size_t bytes) { bytes_ += bytes; }
    const char* left() const { return buffer_.data() + sent_; }
    std::size_t bytes_left() const { return bytes_ - sent_; }
    void sent(std::size_t bytes) {
      sent_ += bytes;
      if (sent_ == bytes_) sent_ = bytes_ = 0;
    }

   private:
    std::vector<char> buffer_;
    std::size_t sent_ = 0;
    std::size_t bytes_ = 0;
  };

  enum class Stage { kHandshake, kRequest, kServed, kRefused };

  bool is_late() const { return Clock::now() - since_ >= kRequestMax; }
  // These, too, are false when the connection is over.
  bool take_request(bool may_be_served);
  bool reach_server();
  bool refuse();
  bool serve();
  bool from_client(bool& moved);
  bool to_client(bool& moved);

  DoorSocket client_;
  Descriptor server_;  // open once there is a request
  const int server_port_;
  Stage stage_ = Stage::kHandshake;
  Pipe to_server_{0};
  Pipe to_client_{0};
  bool client_has_ended_ = false;  // it sends no more, and may still read
  bool server_knows_ = false;      // of that
  const Clock::time_point since_ = Clock::now();
};

}  // namespace tessera
