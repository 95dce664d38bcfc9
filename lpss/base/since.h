// Fields that stored forms have not always had.
#pragma once

#include <cstdint>

namespace tessera {

// In a description of fields: one that is there since a version. What was stored before has its default.
template <typename T>
struct Since {
  std::uint32_t version;
  T& value;
};

template <typename T>
Since<T> since(std::uint32_t version, T& value) {
  return {version, value};
}

}  // namespace tessera
