// What is packed (wire.h) as bytes, and back, and what it consists of: the archives of describe().
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "lpss/base/since.h"
#include "proto/wire_fields.h"

namespace tessera {

static_assert(std::endian::native == std::endian::little);

// In the second word of an OffsetSet's near ones: a list of far ones follows.
constexpr std::uint64_t kFarFollow = OffsetSet::kNearMax;

template <typename T>
concept Number = std::same_as<T, std::int64_t> || std::same_as<T, std::uint64_t> ||
    std::same_as<T, std::uint32_t> || std::same_as<T, std::uint8_t> || std::same_as<T, double>;

template <typename T>
concept Enumeration = std::same_as<T, Motion> || std::same_as<T, Activity> || std::same_as<T, JointType> ||
    std::same_as<T, DriveMode>;

constexpr bool is_known(Motion motion) { return motion <= Motion::kKinematic; }
constexpr bool is_known(Activity activity) {
  return activity >= Activity::kAwake && activity <= Activity::kWantsSleep;
}
constexpr bool is_known(JointType type) { return type <= JointType::kScrew; }
constexpr bool is_known(DriveMode mode) { return mode <= DriveMode::kServo; }

// Breaks values down into raw bytes for a `Sink` with bytes(const void*, size); used by Meter and Writer.
template <typename Sink>
class Output {
 public:
  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }

  template <typename T>
  void list(std::span<const T> items) {
    put(static_cast<std::uint64_t>(items.size()));
    for (const T& item : items) put(item);
  }

 private:
  void raw(const void* data, std::size_t size) { static_cast<Sink*>(this)->bytes(data, size); }

  void put(Number auto value) { raw(&value, sizeof value); }
  void put(Enumeration auto value) { put(static_cast<std::uint8_t>(value)); }
  void put(bool value) { put(static_cast<std::uint8_t>(value)); }
  void put(const OffsetSet& set) {
    OffsetSet::Near near = set.near();
    if (!set.far().empty()) near[1] |= kFarFollow;
    raw(near.data(), sizeof near);
    if (!set.far().empty()) list(set.far());
  }
  template <std::size_t N>
  void put(const std::array<double, N>& numbers) {
    raw(numbers.data(), sizeof numbers);
  }
  template <typename T, std::size_t N>
  void put(const std::array<T, N>& items) {
    for (const T& item : items) put(item);
  }
  // Most bodies have none.
  void put(const BodyJoints& joints) {
    put(!joints.empty());
    if (joints.empty()) return;
    put(joints.as_child);
    put(joints.as_parent);
  }
  template <typename T>
  void put(const Since<T>& field) {
    put(field.value);
  }
  void put(const std::string& text) {
    put(static_cast<std::uint64_t>(text.size()));
    raw(text.data(), text.size());
  }
  template <typename T>
  void put(const std::vector<T>& items) {
    list(std::span<const T>(items));
  }
  template <typename T>
  void put(const std::optional<T>& item) {
    put(item.has_value());
    if (item) put(*item);
  }
  template <typename T, typename U>
  void put(const std::pair<T, U>& items) {
    put(items.first);
    put(items.second);
  }
  template <typename T>
  void put(const std::shared_ptr<const T>& item) {
    put(*item);
  }
  template <typename... Alternatives>
  void put(const std::variant<Alternatives...>& choice) {
    put(static_cast<std::uint8_t>(choice.index()));
    std::visit([this](const auto& alternative) { put(alternative); }, choice);
  }
  template <typename T>
  requires requires(Sink& sink, const T& x) { describe(sink, x); }
  void put(const T& x) { describe(static_cast<Sink&>(*this), x); }
};

class Meter : public Output<Meter> {
 public:
  void bytes(const void*, std::size_t size) { size_ += size; }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_ = 0;
};

// Writes into memory that a Meter has found to be large enough.
class Writer : public Output<Writer> {
 public:
  explicit Writer(char* to) : to_(to) {}

  void bytes(const void* data, std::size_t size) {
    if (size != 0) std::memcpy(to_, data, size);
    to_ += size;
  }

 private:
  char* to_;
};

// Reads what was written with the fields of a version, until the first value that does not fit; from then on
// every value is a default, as fields are that the version did not have.
class Reader {
 public:
  Reader(std::string_view bytes, std::uint32_t version) : rest_(bytes), version_(version) {}

  template <typename... Fields>
  void operator()(Fields&&... fields) {
    (get(fields), ...);
  }

  template <typename T>
  void list(std::vector<T>& items) {
    std::uint64_t count = 0;
    get(count);
    // Every item takes at least one byte, so a larger count is invalid. Memory is allocated as items are
    // read.
    if (count > rest_.size()) return fail();
    items.reserve(std::min<std::size_t>(count, rest_.size() / sizeof(T) + 1));
    for (std::uint64_t n = 0; n < count && ok_; ++n) get(items.emplace_back());
  }

  // Whether all bytes were consumed.
  absl::Status done(const char* what) const {
    if (ok_ && rest_.empty()) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat(what, ok_ ? ": bytes are left over" : ": the bytes do not fit"));
  }

 private:
  void fail() {
    ok_ = false;
    rest_ = {};
  }

  void raw(void* to, std::size_t size) {
    if (size > rest_.size()) return fail();
    std::memcpy(to, rest_.data(), size);
    rest_.remove_prefix(size);
  }

  void get(Number auto& value) { raw(&value, sizeof value); }
  template <Enumeration T>
  void get(T& value) {
    std::uint8_t number = 0;
    get(number);
    if (!ok_) return;
    if (!is_known(static_cast<T>(number))) return fail();
    value = static_cast<T>(number);
  }
  void get(bool& value) {
    std::uint8_t number = 0;
    get(number);
    if (number > 1) return fail();
    value = number == 1;
  }
  void get(OffsetSet& set) {
    OffsetSet::Near near{};
    raw(near.data(), sizeof near);
    std::vector<SectorOffset> far;
    if ((near[1] & kFarFollow) != 0) list(far);
    near[1] &= ~kFarFollow;
    if (near[1] >= OffsetSet::kNearMax || !OffsetSet::are_far(far)) return fail();
    set = OffsetSet(near, std::move(far));
  }
  template <std::size_t N>
  void get(std::array<double, N>& numbers) {
    raw(numbers.data(), sizeof numbers);
  }
  template <typename T, std::size_t N>
  void get(std::array<T, N>& items) {
    for (T& item : items) get(item);
  }
  void get(BodyJoints& joints) {
    bool are_there = false;
    get(are_there);
    if (!are_there) return;
    get(joints.as_child);
    get(joints.as_parent);
    if (joints.empty()) fail();
  }
  template <typename T>
  void get(Since<T>& field) {
    if (version_ >= field.version) get(field.value);
  }
  void get(std::string& text) {
    std::uint64_t size = 0;
    get(size);
    if (size > rest_.size()) return fail();
    text.assign(rest_.substr(0, size));
    rest_.remove_prefix(size);
  }
  template <typename T>
  void get(std::vector<T>& items) {
    list(items);
  }
  template <typename T>
  void get(std::optional<T>& item) {
    bool is_there = false;
    get(is_there);
    if (ok_ && is_there) get(item.emplace());
  }
  template <typename T, typename U>
  void get(std::pair<T, U>& items) {
    get(items.first);
    get(items.second);
  }
  template <typename T>
  void get(std::shared_ptr<const T>& item) {
    auto read = std::make_shared<T>();
    get(*read);
    item = std::move(read);
  }
  template <std::size_t Index = 0, typename... Alternatives>
  void alternative(std::uint8_t index, std::variant<Alternatives...>& choice) {
    if constexpr (Index == sizeof...(Alternatives)) {
      fail();
    } else if (index == Index) {
      get(choice.template emplace<Index>());
    } else {
      alternative<Index + 1>(index, choice);
    }
  }
  template <typename... Alternatives>
  void get(std::variant<Alternatives...>& choice) {
    std::uint8_t index = 0;
    get(index);
    if (ok_) alternative(index, choice);
  }
  template <typename T>
  requires requires(Reader& reader, T& x) { describe(reader, x); }
  void get(T& x) { describe(*this, x); }

  std::string_view rest_;
  const std::uint32_t version_;
  bool ok_ = true;
};

// Tells what a type consists of, in a text that changes with it, from a default value.
class Outline {
 public:
  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (tell(fields), ...);
  }

  const std::string& text() const { return text_; }

 private:
  template <Number T>
  void tell(const T&) {
    absl::StrAppend(&text_,
                    std::floating_point<T>    ? "f"
                    : std::signed_integral<T> ? "i"
                                              : "u",
                    sizeof(T), " ");
  }
  template <Enumeration T>
  void tell(const T&) {
    text_ += "enum ";
  }
  void tell(bool) { text_ += "bool "; }
  void tell(const OffsetSet&) { text_ += "offsets "; }
  template <std::size_t N>
  void tell(const std::array<double, N>&) {
    absl::StrAppend(&text_, "f8*", N, " ");
  }
  template <typename T, std::size_t N>
  void tell(const std::array<T, N>& items) {
    for (const T& item : items) tell(item);
  }
  void tell(const BodyJoints& joints) { nested("joints", joints.as_child, joints.as_parent); }
  void tell(const std::string&) { text_ += "text "; }
  template <typename T>
  void tell(const std::vector<T>&) {
    nested("list", T{});
  }
  template <typename T>
  void tell(const std::optional<T>&) {
    nested("optional", T{});
  }
  template <typename T, typename U>
  void tell(const std::pair<T, U>& items) {
    nested("pair", items.first, items.second);
  }
  template <typename T>
  void tell(const std::shared_ptr<const T>&) {
    tell(T{});
  }
  template <typename... Alternatives>
  void tell(const std::variant<Alternatives...>&) {
    nested("one of", Alternatives{}...);
  }
  template <typename T>
  void tell(const Since<T>& field) {
    tell(field.value);
  }
  template <typename T>
  requires requires(Outline& outline, const T& x) { describe(outline, x); }
  void tell(const T& x) {
    text_ += "{";
    describe(*this, x);
    text_ += "} ";
  }

  template <typename... Fields>
  void nested(absl::string_view kind, const Fields&... fields) {
    absl::StrAppend(&text_, kind, "(");
    (tell(fields), ...);
    text_ += ") ";
  }

  std::string text_;
};

template <typename Write>
std::string packed(const Write& write) {
  Meter meter;
  write(meter);
  std::string bytes(meter.size(), '\0');
  Writer writer(bytes.data());
  write(writer);
  return bytes;
}

template <typename T>
std::string pack_struct(const T& value) {
  return packed([&](auto& archive) { archive(value); });
}

template <typename T>
std::string pack_list(std::span<const T> items) {
  return packed([&](auto& archive) { archive.list(items); });
}

template <typename T>
absl::StatusOr<T> unpack_struct(std::string_view bytes, std::uint32_t version, const char* what) {
  Reader reader(bytes, version);
  T value;
  reader(value);
  if (absl::Status status = reader.done(what); !status.ok()) return status;
  return value;
}

template <typename... T>
std::string outline_of() {
  Outline outline;
  outline(T{}...);
  return outline.text();
}

}  // namespace tessera
