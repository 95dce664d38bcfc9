// The numbers of a program by name: an enumeration of places beside its table.
#pragma once

#include <cstddef>
#include <span>

namespace tessera {

// `table[place]`, for an enumerator that names the place.
template <typename Place, typename T>
T& at(std::span<T> numbers, Place place) {
  return numbers[static_cast<std::size_t>(place)];
}

}  // namespace tessera
