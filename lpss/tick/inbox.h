// What came in from all servers, in an order that does not depend on who sent it.
#pragma once

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "lpss/tick/messages.h"

namespace tessera {

// All items of one kind in an inbox, in ascending order of ids, whoever sent them.
template <typename T, typename Id>
std::vector<T> collected(std::vector<Exchange>& inbox, std::vector<T> Exchange::*items, Id&& id) {
  std::vector<T> all;
  for (Exchange& message : inbox) {
    std::move((message.*items).begin(), (message.*items).end(), std::back_inserter(all));
  }
  std::sort(all.begin(), all.end(), [&](const T& a, const T& b) { return id(a) < id(b); });
  return all;
}

}  // namespace tessera
