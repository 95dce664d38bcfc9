#include "daemon/door_relay.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <string>

#include "daemon/whole_request.h"

namespace tessera {
namespace {

using Result = DoorSocket::Result;

constexpr std::size_t kPieceBytes = 64 << 10;  // a whole request, too
static_assert(kPieceBytes > kRequestHeadBytesMax + kRequestBodyBytesMax);

// A socket that is not connected yet says ENOTCONN.
bool would_block() { return errno == EAGAIN || errno == EINTR || errno == ENOTCONN; }

std::string refusal() {
  const std::string why =
      absl::StrCat("a request has at most ", kRequestHeadBytesMax, " bytes of headers and ",
                   kRequestBodyBytesMax, " of content, with a Content-Length\n");
  return absl::StrCat("HTTP/1.1 413 Content Too Large\r\nContent-Type: text/plain\r\nContent-Length: ",
                      why.size(), "\r\nConnection: close\r\n\r\n", why);
}

}  // namespace

std::array<pollfd, 2> DoorRelay::polled() const {
  const bool takes_more = stage_ != Stage::kServed || to_server_.empty();
  short client = takes_more && !client_has_ended_ ? POLLIN : 0;
  if (client_.waits_to_write()) client |= POLLOUT;
  short server = to_client_.empty() ? POLLIN : 0;
  if (!to_server_.empty()) server |= POLLOUT;
  return {{{client_.descriptor(), client, 0}, {server_.get(), server, 0}}};
}

bool DoorRelay::carry(bool may_be_served) {
  client_.begin_turn();
  if (stage_ == Stage::kHandshake) {
    const Result result = client_.handshake();
    if (result == Result::kOver) return false;
    if (result == Result::kWaits) return !is_late();
    stage_ = Stage::kRequest;
    to_server_ = Pipe(kPieceBytes);
  }
  if (stage_ == Stage::kRequest && !take_request(may_be_served)) return false;
  switch (stage_) {
    case Stage::kHandshake:
    case Stage::kRequest:
      return !is_late();
    case Stage::kServed:
      return serve();
    case Stage::kRefused:
      return refuse() && !is_late();
  }
  return false;
}

bool DoorRelay::take_request(bool may_be_served) {
  while (!to_server_.full() && !client_has_ended_) {
    std::size_t got = 0;
    const Result result = client_.read(to_server_.free_space(), to_server_.free_bytes(), got);
    if (result == Result::kWaits) break;
    client_has_ended_ = result == Result::kOver;
    to_server_.filled(got);
  }
  switch (part_of_request({to_server_.left(), to_server_.bytes_left()})) {
    case RequestPart::kSome:
      return !client_has_ended_;
    case RequestPart::kUnfit: {
      const std::string answer = refusal();
      to_server_ = Pipe(kPieceBytes);
      to_client_ = Pipe(answer.size());
      std::ranges::copy(answer, to_client_.free_space());
      to_client_.filled(answer.size());
      stage_ = Stage::kRefused;
      return true;
    }
    case RequestPart::kWhole:
      break;
  }
  if (!may_be_served) return true;
  to_client_ = Pipe(kPieceBytes);
  stage_ = Stage::kServed;
  return reach_server();
}

bool DoorRelay::reach_server() {
  server_ = Descriptor(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(server_port_));
  const int yes = 1;
  setsockopt(server_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return connect(server_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 ||
         errno == EINPROGRESS;
}

// What the client still sends is thrown away: it might not read the answer before it has sent all.
bool DoorRelay::refuse() {
  if (!to_client_.empty()) {
    std::size_t sent = 0;
    const Result result = client_.write(to_client_.left(), to_client_.bytes_left(), sent);
    if (result != Result::kDone) return result == Result::kWaits;
    to_client_.sent(sent);
    if (!to_client_.empty()) return true;
    client_.end();
  }
  for (Result result = Result::kDone; result != Result::kWaits;) {
    std::size_t got = 0;
    result = client_.read(to_server_.free_space(), to_server_.free_bytes(), got);
    if (result == Result::kOver || is_late()) return false;
  }
  return true;
}

// Each direction until it has to wait.
bool DoorRelay::serve() {
  for (bool moved = true; moved;) {
    moved = false;
    if (!from_client(moved) || !to_client(moved)) return false;
  }
  return true;
}

bool DoorRelay::from_client(bool& moved) {
  if (to_server_.empty() && !client_has_ended_) {
    std::size_t got = 0;
    const Result result = client_.read(to_server_.free_space(), to_server_.free_bytes(), got);
    if (result == Result::kWaits) return true;
    client_has_ended_ = result == Result::kOver;
    to_server_.filled(got);
  }
  if (to_server_.empty()) {
    if (!server_knows_) shutdown(server_.get(), SHUT_WR);
    server_knows_ = true;
    return true;
  }
  const ssize_t sent = send(server_.get(), to_server_.left(), to_server_.bytes_left(), MSG_NOSIGNAL);
  if (sent < 0) return would_block();
  to_server_.sent(static_cast<std::size_t>(sent));
  moved = true;
  return true;
}

bool DoorRelay::to_client(bool& moved) {
  if (to_client_.empty()) {
    const ssize_t got = recv(server_.get(), to_client_.free_space(), to_client_.free_bytes(), 0);
    if (got == 0) {
      client_.end();
      return false;
    }
    if (got < 0) return would_block();
    to_client_.filled(static_cast<std::size_t>(got));
  }
  std::size_t sent = 0;
  const Result result = client_.write(to_client_.left(), to_client_.bytes_left(), sent);
  if (result != Result::kDone) return result == Result::kWaits;
  to_client_.sent(sent);
  moved = true;
  return true;
}

}  // namespace tessera
