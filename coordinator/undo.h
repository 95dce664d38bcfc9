// Takes back the first part of what turns out to be impossible as a whole.
#pragma once

#include <absl/functional/any_invocable.h>

#include <utility>
#include <vector>

namespace tessera {

class Undo {
 public:
  // What takes back the change that is just being made.
  template <typename Step>
  void add(Step step) {
    steps_.emplace_back(std::move(step));
  }

  // All changes since the last call of either stay, or are taken back, the last one first.
  void keep() { steps_.clear(); }
  void roll_back() {
    for (; !steps_.empty(); steps_.pop_back()) steps_.back()();
  }

 private:
  std::vector<absl::AnyInvocable<void()>> steps_;
};

}  // namespace tessera
