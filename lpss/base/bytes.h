// Numbers as bytes, in the layout of this machine.
#pragma once

#include <cstring>
#include <string>
#include <string_view>

namespace tessera {

class ByteWriter {
 public:
  explicit ByteWriter(std::string& bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(const T& value) const {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }

 private:
  std::string& bytes_;
};

// What is read beyond the end is left as it was, and is_short() from then on.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(T& value) const {
    if (bytes_.size() < sizeof(value)) {
      is_short_ = true;
      return;
    }
    std::memcpy(static_cast<void*>(&value), bytes_.data(), sizeof(value));
    bytes_.remove_prefix(sizeof(value));
  }
  void operator()(bool& value) const { value = get<unsigned char>() != 0; }

  template <typename T>
  T get() const {
    T value{};
    (*this)(value);
    return value;
  }

  std::size_t left() const { return bytes_.size(); }
  bool is_short() const { return is_short_; }
  bool at_end() const { return !is_short_ && bytes_.empty(); }

 private:
  mutable std::string_view bytes_;
  mutable bool is_short_ = false;
};

}  // namespace tessera
