#include "viewer/frame_encoder.h"

#include <bit>
#include <cstring>
#include <utility>

namespace tessera::viewer {
namespace {

static_assert(std::endian::native == std::endian::little, "frames are written in memory layout");

constexpr std::uint8_t kAsleep = 1;
constexpr std::uint8_t kAboard = 2;

template <typename T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// One array: the same member of every element.
template <typename T, typename Member>
void put_all(std::string& bytes, std::span<const T> elements, Member T::*member) {
  std::size_t place = bytes.size();
  bytes.resize(place + elements.size() * sizeof(Member));
  for (const T& element : elements) {
    std::memcpy(bytes.data() + place, &(element.*member), sizeof(Member));
    place += sizeof(Member);
  }
}

}  // namespace

std::string FrameEncoder::encode(std::uint64_t tick, std::vector<SeenBody> bodies) {
  const bool is_key = !std::exchange(started_, true);
  if (is_key) shown_.clear();
  std::vector<SeenBody> changed;
  std::vector<std::uint64_t> gone;
  auto before = shown_.cbegin();
  for (const SeenBody& body : bodies) {
    for (; before != shown_.cend() && before->id < body.id; ++before) gone.push_back(before->id);
    const bool is_known = before != shown_.cend() && before->id == body.id;
    if (!is_known || *before != body) changed.push_back(body);
    if (is_known) ++before;
  }
  for (; before != shown_.cend(); ++before) gone.push_back(before->id);
  shown_ = std::move(bodies);
  if (!is_key && changed.empty() && gone.empty()) return {};

  std::string bytes;
  bytes.reserve(sizeof(FrameHeader) + changed.size() * sizeof(SeenBody) + gone.size() * sizeof(double));
  put(bytes,
      FrameHeader{FrameKind::kBodies, is_key ? kKeyFrame : 0, static_cast<std::uint32_t>(changed.size()),
                  static_cast<std::uint32_t>(gone.size()), tick});
  const std::span<const SeenBody> all(changed);
  for (const SeenBody& body : all) put(bytes, static_cast<double>(body.id));
  for (const std::uint64_t id : gone) put(bytes, static_cast<double>(id));
  put_all(bytes, all, &SeenBody::position);
  put_all(bytes, all, &SeenBody::orientation);
  put_all(bytes, all, &SeenBody::speed);
  put_all(bytes, all, &SeenBody::server);
  for (const SeenBody& body : all)
    put(bytes, static_cast<std::uint8_t>((body.asleep ? kAsleep : 0) | (body.aboard ? kAboard : 0)));
  return bytes;
}

std::string encode(std::uint64_t tick, std::span<const SeenContact> contacts) {
  std::string bytes;
  put(bytes, FrameHeader{FrameKind::kContacts, 0, static_cast<std::uint32_t>(contacts.size()), 0, tick});
  put_all(bytes, contacts, &SeenContact::position);
  put_all(bytes, contacts, &SeenContact::normal);
  put_all(bytes, contacts, &SeenContact::impulse);
  return bytes;
}

}  // namespace tessera::viewer
