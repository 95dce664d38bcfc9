// The binary format of WebAssembly: bytes, numbers in LEB128, names.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

namespace tessera::wasm {

// What is wrong with a module, and where. Thrown and caught inside this folder.
struct Refusal {
  std::size_t offset = 0;  // in the file
  std::string what;
};

// Reads a part of a file. Throws Refusal where it ends too early or a number is malformed.
class Reader {
 public:
  Reader(std::span<const std::uint8_t> file, std::size_t begin, std::size_t end)
      : file_(file), at_(begin), end_(end) {}

  std::size_t offset() const { return at_; }
  bool ended() const { return at_ == end_; }
  std::size_t left() const { return end_ - at_; }

  [[noreturn]] void refuse(std::string what) const { throw Refusal{at_, std::move(what)}; }

  std::uint8_t byte() {
    if (ended()) refuse("it ends too early");
    return file_[at_++];
  }
  std::uint32_t u32() { return static_cast<std::uint32_t>(unsigned_number(32)); }
  std::int32_t s32() { return static_cast<std::int32_t>(signed_number(32)); }
  std::int64_t s64() { return signed_number(64); }
  // A number of items of which each has at least one byte.
  std::uint32_t count(std::uint32_t most, std::string_view of_what);
  std::span<const std::uint8_t> bytes(std::size_t size) {
    if (size > left()) refuse("it ends too early");
    at_ += size;
    return file_.subspan(at_ - size, size);
  }
  std::string_view name() {
    const auto text = bytes(u32());
    return {reinterpret_cast<const char*>(text.data()), text.size()};
  }
  // The next bytes, as a reader of their own.
  Reader part(std::size_t size) {
    const std::size_t begin = at_;
    bytes(size);
    return {file_, begin, begin + size};
  }
  template <typename T>
  T raw() {
    T value;
    std::memcpy(&value, bytes(sizeof(T)).data(), sizeof(T));
    return value;
  }
  // The bytes since an earlier offset().
  std::span<const std::uint8_t> since(std::size_t begin) const { return file_.subspan(begin, at_ - begin); }

 private:
  std::uint64_t unsigned_number(int bits);
  std::int64_t signed_number(int bits);

  std::span<const std::uint8_t> file_;
  std::size_t at_;
  std::size_t end_;
};

class Writer {
 public:
  void byte(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  void u32(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) byte(static_cast<std::uint8_t>(value | 0x80));
    byte(static_cast<std::uint8_t>(value));
  }
  void s64(std::int64_t value) {
    for (; value < -64 || value > 63; value >>= 7) byte(static_cast<std::uint8_t>(value | 0x80));
    byte(static_cast<std::uint8_t>(value & 0x7f));
  }
  template <typename T>
  void raw(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void append(std::span<const std::uint8_t> bytes) {
    bytes_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void append(std::string_view bytes) { bytes_.append(bytes); }
  void name(std::string_view text) {
    u32(text.size());
    append(text);
  }

  std::size_t size() const { return bytes_.size(); }
  std::string& text() { return bytes_; }
  std::string_view text() const { return bytes_; }

 private:
  std::string bytes_;
};

}  // namespace tessera::wasm
