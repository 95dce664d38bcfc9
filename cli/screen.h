// Standard output as one screen that is drawn anew, as far as it is a terminal.
#pragma once

#include <absl/strings/string_view.h>

#include <cstddef>
#include <optional>

namespace tessera::cli {

class Screen {
 public:
  // Without `redraw`, and where there is no terminal, each text follows the one before it, after an empty
  // line.
  explicit Screen(bool redraw);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  // How many lines can be seen at once; nullopt: any number.
  std::optional<std::size_t> lines() const;

  // `text` in whole lines; what is too wide for a screen is cut.
  void draw(absl::string_view text);

 private:
  bool redraw_;
  bool drawn_ = false;
};

}  // namespace tessera::cli
