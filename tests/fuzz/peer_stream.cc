// Packets of a peer, in any order and from any session, among calls of this end.
#include "transport/peer_stream.h"

#include "lpss/base/invariant.h"
#include "tests/fuzz/input.h"

namespace tessera {
namespace {

constexpr Session kSelf = 1;
constexpr std::size_t kStepsMax = 1000;
constexpr std::size_t kOutgoingBytesMax = 3 * kPartBytes;

// Sends what there is to send: that ends, whatever the peer says.
void drain(PeerStream& stream) {
  for (std::size_t n = 0; const std::optional<Packet> packet = stream.next(); ++n) {
    invariant(n < 10 * kStepsMax, "a stream has something to send for ever");
    invariant(packet->payload.size() <= kPartBytes, "a part fits into a datagram");
    stream.sent(*packet);
  }
}

Packet packet_of(fuzz::Input& input) {
  Packet packet;
  const auto control = input.number<std::uint8_t>();
  packet.sync = (control & 1) != 0;
  packet.welcome = (control & 2) != 0;
  packet.to_session = (control & 4) != 0 ? input.number<std::uint64_t>() : kSelf;
  packet.from_session = input.number<std::uint8_t>();
  // Numbers of parts are small, or anything at all.
  const bool any = (control & 8) != 0;
  packet.sequence = any ? input.number<std::uint64_t>() : input.number<std::uint8_t>();
  packet.acknowledged = any ? input.number<std::uint64_t>() : input.number<std::uint8_t>();
  packet.rest = any ? input.number<std::uint64_t>() : input.number<std::uint8_t>();
  packet.payload = input.piece(input.number<std::uint8_t>());
  return packet;
}

void step(PeerStream& stream, fuzz::Input& input, std::vector<Delivery>& deliveries) {
  switch (input.number<std::uint8_t>() % 8) {
    case 0:
      return stream.push(std::string(input.number<std::uint16_t>() % kOutgoingBytesMax, 'x'));
    case 1:
      return stream.connected();
    case 2:
      return stream.disconnected();
    case 3:
      return stream.heard_of();
    case 4:
      return stream.fell_silent(input.number<std::uint8_t>());
    case 5:
      return stream.forget();
    default:
      return stream.accept(packet_of(input), deliveries);
  }
}

}  // namespace
}  // namespace tessera

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  fuzz::Input input(fuzz::text_of(data, size));
  PeerStream stream(NodeId{7}, kSelf);
  std::vector<Delivery> deliveries;
  for (std::size_t n = 0; n < kStepsMax && !input.empty(); ++n) {
    step(stream, input, deliveries);
    drain(stream);
    stream.take_loss();
  }
  std::size_t delivered = 0;
  for (const Delivery& delivery : deliveries) delivered += delivery.payload.size();
  invariant(delivered <= size, "no more is delivered than has arrived");
  return 0;
}
